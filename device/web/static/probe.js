// The probe's REST interface: the stream of statuses, a press, a measurement. Paths and fields: docs of /api/v1.

const API = "/api/v1";
const SILENCE_MS = 2000; // a status arrives every 50 to 100 ms: after this long the figures are old
const REOPEN_MS = 3000;
const WATCH_MS = 250;
const ANSWER_MS = 5000;
const RELEASE_MS = 600000; // a slow stick

/** Load the page anew when it is no longer the daemon that answers, but what stands in for it and says why. */
async function loadFallback() {
  const response = await fetch("/fallback/state", { signal: AbortSignal.timeout(ANSWER_MS) }).catch(() => null);
  if (response?.ok) location.reload();
}

/** Call onStatus with each status, and onSilence again and again while none arrives. */
export function followStatus(onStatus, onSilence) {
  let source = null;
  let openedAt = 0;
  let heardAt = performance.now();

  function open() {
    source?.close();
    openedAt = performance.now();
    source = new EventSource(`${API}/events`);
    source.addEventListener("status", (event) => {
      const status = JSON.parse(event.data);
      heardAt = performance.now();
      onStatus(status);
    });
  }

  // EventSource gives up for good after an HTTP error and never notices a pulled cable, so the page reopens it itself.
  function watch() {
    const now = performance.now();
    if (now - heardAt <= SILENCE_MS) return;
    onSilence();
    if (now - openedAt <= REOPEN_MS) return;
    loadFallback();
    open();
  }

  open();
  setInterval(watch, WATCH_MS);
}

/** The sentence of an application/problem+json answer (RFC 9457). */
async function problemSentence(response) {
  const problem = await response.json().catch(() => ({}));
  const cause = problem.detail || problem.title || `The probe answered ${response.status}.`;
  return [problem.code, cause, problem.remedy].filter(Boolean).join(" ");
}

async function ask(method, path, body, { type = "application/json", withinMs = ANSWER_MS } = {}) {
  const options = { method, body, headers: { "Content-Type": type }, signal: AbortSignal.timeout(withinMs) };
  const response = await fetch(API + path, options).catch(() => {
    throw new Error("The probe did not answer. Try again.");
  });
  if (!response.ok) throw new Error(await problemSentence(response));
  return response;
}

export const startPress = (wish) => ask("POST", "/presses", JSON.stringify(wish));
export const finishScan = (id) => ask("POST", `/presses/${encodeURIComponent(id)}/finish`);
export const cancelPress = (id) => ask("DELETE", `/presses/${encodeURIComponent(id)}`);
export const imageUrl = (id) => `${API}/measurements/${encodeURIComponent(id)}/image.png`;

export async function takeTare() {
  return (await ask("POST", "/tare")).json();
}

export const startSelfTest = (wanted) => ask("POST", "/self-test", JSON.stringify(wanted));

export async function fetchSelfTest() {
  return (await ask("GET", "/self-test")).json();
}

export async function fetchDevice() {
  return (await ask("GET", "/device")).json();
}

export async function fetchMeasurement(id) {
  return (await ask("GET", `/measurements/${encodeURIComponent(id)}`)).json();
}

export async function fetchUpdates() {
  return (await ask("GET", "/updates")).json();
}

/** Send a release file; it goes from the stick to the probe part by part, never whole through the memory. */
export async function sendRelease(file) {
  return (await ask("POST", "/updates", file, { type: "application/octet-stream", withinMs: RELEASE_MS })).json();
}

export async function goBack() {
  return (await ask("POST", "/updates/roll-back", "{}")).json();
}
