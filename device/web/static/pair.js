// Pairing: at the probe's own screen it shows a code and who has a token; anywhere else it takes the code.

import { byId, setText } from "./base/dom.js";

const API = "/api/v1";
const LOOK_MS = 1000;
let ends = 0; // when the code shown ends, by performance.now()

async function ask(path, method = "GET", body = undefined) {
  const headers = { "Content-Type": "application/json" };
  const answer = await fetch(`${API}/${path}`, { method, headers, body: body && JSON.stringify(body) });
  const said = await answer.json();
  return { status: answer.status, said };
}

const words = ({ said }) => [said.detail, said.remedy].filter(Boolean).join(" ");

function showCode(said) {
  ends = performance.now() + 1000 * said.valid_s;
  setText(byId("shown-code"), said.code);
  setText(byId("shown-url"), said.network?.url ?? "This probe is served to no other machine (server.host).");
  setText(byId("shown-sha256"), said.network?.certificate_sha256 ?? "none");
  byId("shown").hidden = false;
}

function showLeft() {
  const left = Math.max(0, ends - performance.now()) / 1000;
  if (ends > 0 && left === 0) byId("shown").hidden = true;
  setText(byId("shown-valid"), `${Math.ceil(left)} s`);
}

async function showTokens() {
  const { said } = await ask("tokens");
  const rows = said.tokens.filter((token) => token.revoked_at === null).map((token) => {
    const row = document.createElement("li");
    const text = document.createElement("span");
    const end = document.createElement("button");
    setText(text, `${token.name}: ${token.scope}, until ${token.expires_at.slice(0, 10)}`);
    setText(end, "Revoke");
    end.type = "button";
    end.addEventListener("click", async () => {
      const answer = await ask(`tokens/${token.id}`, "DELETE");
      setText(byId("line"), answer.status === 200 ? `${token.name} is not let in any more.` : words(answer));
      await showTokens();
    });
    row.append(text, end);
    return row;
  });
  byId("tokens").replaceChildren(...rows);
}

byId("ask").addEventListener("submit", async (event) => {
  event.preventDefault();
  const answer = await ask("pairing", "POST", { name: byId("name").value.trim(), scope: byId("scope").value });
  setText(byId("line"), answer.status === 201 ? "" : words(answer));
  if (answer.status === 201) showCode(answer.said);
});

byId("bring").addEventListener("submit", async (event) => {
  event.preventDefault();
  const answer = await ask("pairing/claim", "POST", { code: byId("code").value, as_cookie: true });
  setText(byId("line"), answer.status === 201 ? "Paired." : words(answer));
  if (answer.status === 201) location.assign("/");
});

async function begin() {
  const { status, said } = await ask("pairing");
  const isOwnScreen = status === 200 || status === 404;
  byId("offer").hidden = !isOwnScreen;
  byId("bring").hidden = isOwnScreen;
  if (!isOwnScreen) return;
  if (status === 200) showCode(said);
  await showTokens();
  setInterval(() => { showLeft(); if (document.visibilityState === "visible") void showTokens(); }, LOOK_MS);
}

void begin();
