// The page of a probe whose software does not run: loaded anew when what is known changes, and when the probe is back.
// What a person chose on the probe's screen, language and colours, holds here, too: what this browser remembers, else
// what the probe keeps, in which the page comes.

const LOOK_MS = 1000;
const PREFIX = "tsis."; // of what the screen remembers (device/web/static/base/memory.js)

/** As device/web/static/base/panel.js has it; the button is on the probe's own page alone. */
const isPanel = () => matchMedia("(display-mode: fullscreen), (pointer: coarse)").matches;

function remembered(name) {
  try {
    return localStorage.getItem(PREFIX + name);
  } catch {
    return null;
  }
}

/** Show the page in another language than it came in. */
async function speak(language) {
  const response = await fetch(`/?language=${encodeURIComponent(language)}`, { cache: "no-store" });
  const asked = new DOMParser().parseFromString(await response.text(), "text/html");
  if (asked.documentElement.lang !== language || !asked.body.dataset.revision) return;
  document.documentElement.lang = language;
  Object.assign(document.body.dataset, asked.body.dataset);
  document.getElementById("panel").replaceWith(asked.getElementById("panel"));
}

async function ask(path) {
  const headers = { "Content-Type": "application/json" };
  const response = await fetch(path, { method: "POST", headers });
  if (!response.ok) {
    const { detail = "", remedy = "" } = await response.json().catch(() => ({}));
    throw new Error(`${detail} ${remedy}`);
  }
  return response;
}

function offer(id, act) {
  const button = document.getElementById(id);
  const told = document.getElementById("told");
  button?.addEventListener("click", async () => {
    button.disabled = true;
    told.textContent = document.body.dataset.moment;
    try {
      await act();
      told.textContent = button.dataset.done;
    } catch (error) {
      const service = document.createElement("small");
      service.lang = "en";
      service.textContent = error.message;
      told.replaceChildren(document.body.dataset.refused, " ", service);
      button.disabled = false;
    }
  });
}

async function look() {
  const response = await fetch("/fallback/state", { cache: "no-store" }).catch(() => null);
  const state = response?.ok ? await response.json().catch(() => null) : null;
  // The daemon has no such path: it is back.
  if (response?.status === 404 || (state && state.revision !== document.body.dataset.revision)) location.reload();
}

if (remembered("colours")) document.documentElement.dataset.colours = remembered("colours");
const chosen = remembered("language");
if (chosen && chosen !== document.documentElement.lang) await speak(chosen).catch(() => {});
offer("roll-back", () => ask("/api/v1/updates/roll-back"));
offer("support", async () => {
  const { dataset } = document.getElementById("support");
  if (isPanel()) {
    dataset.done = dataset.panel;
    return;
  }
  const link = document.createElement("a");
  link.href = URL.createObjectURL(await (await ask("/fallback/support")).blob());
  link.download = "tsis-support.zip";
  link.click();
});
setInterval(look, LOOK_MS);
