// Pairing: at the probe's own screen it shows a code and who has a token; anywhere else it takes the code.

import { button, byId, element, setText } from "./base/dom.js";
import { remembered } from "./base/memory.js";
import { day, figure, LANGUAGES, chooseLanguage, isSaid, language, say, sayPage } from "./base/words.js";
import { useKeyboard } from "./exam/keyboard.js";

const API = "/api/v1";
const LOOK_MS = 1000;
let ends = 0; // when the code shown ends, by performance.now()

async function ask(path, method = "GET", body = undefined) {
  const headers = { "Content-Type": "application/json" };
  const answer = await fetch(`${API}/${path}`, { method, headers, body: body && JSON.stringify(body) });
  const said = await answer.json();
  return { status: answer.status, said };
}

/** Why something was not done, in the words of the screen's language. */
function words({ said: { code }, status }) {
  return isSaid(`fault.${code}.do`) ? `${say(`fault.${code}.is`)}. ${say(`fault.${code}.do`)}` : say("problem.other", { code: code ?? status });
}

function showCode(said) {
  ends = performance.now() + 1000 * said.valid_s;
  setText(byId("shown-code"), said.code);
  setText(byId("shown-url"), said.network?.url ?? say("pair.no_network"));
  setText(byId("shown-sha256"), said.network?.certificate_sha256 ?? "–");
  showShown(true);
}

/** Show the code, or that another one may be asked for. */
function showShown(isShown) {
  byId("shown").hidden = !isShown;
  byId("ask-again").hidden = !isShown;
}

function showLeft() {
  const left = Math.max(0, ends - performance.now()) / 1000;
  if (ends > 0 && left === 0) showShown(false);
  setText(byId("shown-valid"), say("pair.left", { s: figure(Math.ceil(left), 0) }));
}

/** Take a token from whoever has it; it is not let in any more from then on. */
async function revoke({ id, name }) {
  const answer = await ask(`tokens/${id}`, "DELETE");
  setText(byId("line"), answer.status === 200 ? say("pair.revoked", { name }) : words(answer));
  await showTokens();
}

function tokenRow(token) {
  const row = element("li", "");
  const told = { name: token.name, scope: say(`pair.${token.scope}`), day: day(token.expires_at) };
  row.append(element("span", "", say("pair.token", told)), button("button button-quiet", say("pair.revoke"), () => revoke(token)));
  return row;
}

let tokensShown = "";

async function showTokens() {
  const { said } = await ask("tokens");
  const valid = (said.tokens ?? []).filter((token) => token.revoked_at === null);
  const key = JSON.stringify(valid);
  if (key === tokensShown) return; // a row that is made anew would lose the focus
  tokensShown = key;
  byId("tokens").replaceChildren(...valid.map(tokenRow));
  byId("tokens-none").hidden = valid.length > 0;
}

byId("ask").addEventListener("submit", async (event) => {
  event.preventDefault();
  const answer = await ask("pairing", "POST", { name: byId("name").value.trim(), scope: byId("scope").value });
  setText(byId("line"), answer.status === 201 ? "" : words(answer));
  if (answer.status !== 201) return;
  showCode(answer.said);
  byId("shown").scrollIntoView({ block: "nearest" });
});

byId("ask-again").addEventListener("click", () => { showShown(false); byId("name").focus(); });

byId("bring").addEventListener("submit", async (event) => {
  event.preventDefault();
  const answer = await ask("pairing/claim", "POST", { code: byId("code").value, as_cookie: true });
  setText(byId("line"), answer.status === 201 ? say("pair.done") : words(answer));
  if (answer.status === 201) location.assign("/");
});

async function begin() {
  sayPage();
  document.title = say("pair");
  document.documentElement.dataset.colours = remembered("colours") ?? "auto";
  for (const one of Object.keys(LANGUAGES)) {
    byId(`language-${one}`).setAttribute("aria-pressed", one === language);
    byId(`language-${one}`).addEventListener("click", () => chooseLanguage(one));
  }
  useKeyboard();
  const { status, said } = await ask("pairing");
  const isOwnScreen = status === 200 || status === 404;
  byId("offer").hidden = !isOwnScreen;
  byId("bring").hidden = isOwnScreen;
  if (!isOwnScreen) return;
  if (status === 200) showCode(said);
  tokensShown = "none yet";
  await showTokens();
  setInterval(() => { showLeft(); if (document.visibilityState === "visible") void showTokens(); }, LOOK_MS);
}

void begin();
