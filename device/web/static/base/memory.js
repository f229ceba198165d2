// What this browser remembers between loads: language, colours, sound, who examines, and whose exam is open. A browser
// that keeps nothing is as good, for one load. The panel's forgets all with its power, so the probe itself keeps the
// first three of its own screen, and brings them in the page (device/web/screen/kept_choices.py).

const PREFIX = "tsis.";
const SCREEN = "/api/v1/screen";
const ANSWER_MS = 2000;
/** What the probe keeps of its own screen, null on any other machine, whose page says nothing of it. */
const kept = JSON.parse(document.documentElement.dataset.kept ?? "null");

function inBrowser(name) {
  try {
    return localStorage.getItem(PREFIX + name);
  } catch {
    return null;
  }
}

export const remembered = (name) => inBrowser(name) ?? kept?.[name] ?? null;

export function remember(name, value) {
  try {
    if (value === null) localStorage.removeItem(PREFIX + name);
    else localStorage.setItem(PREFIX + name, value);
  } catch {
    // nothing is kept: the choice holds until the page is loaded again
  }
}

/** Remember language, colours or sound; at the probe's own screen in the probe, too, where its disk takes it. */
export async function rememberChoice(name, value) {
  remember(name, value);
  if (!kept) return;
  const [body, headers] = [JSON.stringify({ [name]: value }), { "Content-Type": "application/json" }];
  const signal = AbortSignal.timeout(ANSWER_MS);
  await fetch(SCREEN, { method: "PATCH", body, headers, signal, keepalive: true }).catch(() => {});
}
