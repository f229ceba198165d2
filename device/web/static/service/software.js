// The software's own page: which release runs, what became of the last update, and a release file from a stick.
// While an update is under way the main view says so, too, and keeps saying it while the daemon is away.

import { byId, setText } from "../base/dom.js";
import { isOwnScreen } from "../base/panel.js";
import { fetchUpdates, goBack, sendRelease } from "../base/probe.js";
import { say } from "../base/words.js";
import { openService } from "../press/faults.js";

const UNDER_WAY = new Set(["waiting", "verifying", "unpacking", "switching", "checking"]);
const ENDS = new Set(["rolled_back", "refused", "committed"]);
const LOOK_MS = 1000;
const GLANCE_MS = 5000; // while nobody looks at this page
const BEGINNING = "manifest.json"; // of every release file

const dialog = byId("releases");
let updates = null;
let sending = false;
let problem = "";
let lookedAt = -Infinity;
let asking = false;

const version = (release) => (release ?? "").split("+")[0];
const isUnderWay = () => updates !== null && UNDER_WAY.has(updates.state);

function installing({ state, release }) {
  return state === "waiting" || !release ? say("software.installing_one") : say("software.installing", { version: version(release) });
}

function stepWords({ state, progress }) {
  const step = say(`software.${state}`);
  if (progress === null || state === "waiting") return say("software.now", { step });
  return say("software.now_percent", { step, percent: Math.round(100 * progress) });
}

/** What the main view says of an update under way, or null. */
export function updateLine() {
  return isUnderWay() ? { word: installing(updates), reason: stepWords(updates), tone: "caution" } : null;
}

/** What to say while the daemon is away: title and sentence, null unless that is an update's doing. */
export function absenceWords() {
  return isUnderWay() ? [say("lost.updating"), say("lost.updating.words")] : null;
}

/** How the last update ended. */
function outcomeWords() {
  if (!updates || !ENDS.has(updates.state)) return "";
  return say(`software.${updates.state}`, { release: version(updates.release), version: version(updates.running) });
}

/** The updater's own words of how that came, for service. */
const ownWords = () => (updates?.outcome && ["rolled_back", "refused"].includes(updates.state) ? updates.reason || updates.outcome : "");

function lineWords() {
  if (problem) return problem;
  if (sending) return say("software.reading");
  return isUnderWay() ? installing(updates) : outcomeWords();
}

function showReleases() {
  const installed = updates !== null && updates.state !== "not_installed";
  setText(byId("releases-line"), lineWords());
  dialog.dataset.tone = problem ? "bad" : updates?.state === "rolled_back" || updates?.state === "refused" ? "caution" : "calm";
  setText(byId("release-running"), updates?.running ?? "");
  setText(byId("release-previous"), updates?.previous ?? say("software.none"));
  setText(byId("release-step"), isUnderWay() ? stepWords(updates) : "");
  byId("release-progress").hidden = !(isUnderWay() || sending);
  if (isUnderWay() && updates.progress !== null) byId("release-progress").value = updates.progress;
  else byId("release-progress").removeAttribute("value");
  byId("release-why").hidden = !ownWords();
  const mayChange = installed && isOwnScreen;
  byId("release-form").hidden = !mayChange;
  byId("release-file").disabled = sending || isUnderWay();
  byId("release-back").hidden = !updates?.can_roll_back;
  byId("release-back").disabled = sending || isUnderWay();
  setText(byId("release-back"), say("software.back_to", { version: version(updates?.previous) }));
  setText(byId("release-hint"), say(updates === null || installed ? "software.elsewhere" : "software.not_installed"));
}

async function look() {
  const waited = performance.now() - lookedAt;
  if (asking || waited < (dialog.open || isUnderWay() ? LOOK_MS : GLANCE_MS)) return;
  asking = true;
  lookedAt = performance.now();
  try {
    updates = await fetchUpdates();
  } catch {
    // the daemon is away: what was known last stays, and the main view says that nobody answers
  } finally {
    asking = false;
    showReleases();
  }
}

/** Ask for something of the updater; what it answers, or why not, is shown. */
async function wish(request) {
  sending = true;
  problem = "";
  showReleases();
  try {
    updates = await request();
  } catch (error) {
    problem = error.message;
  } finally {
    sending = false;
    lookedAt = -Infinity;
    showReleases();
  }
}

async function send(file) {
  const begins = await file.slice(0, BEGINNING.length).text();
  if (begins !== BEGINNING) throw new Error(say("software.no_release", { name: file.name }));
  return sendRelease(file);
}

byId("releases-open").addEventListener("click", () => {
  problem = "";
  byId("menu").close();
  dialog.showModal();
  lookedAt = -Infinity;
  look();
});
byId("release-why").addEventListener("click", () => openService(ownWords()));
byId("releases-close").addEventListener("click", () => dialog.close());
byId("release-file").addEventListener("change", ({ target }) => {
  const [file] = target.files;
  if (file) wish(() => send(file));
  target.value = ""; // the same file may be chosen again
});
byId("release-back").addEventListener("click", () => wish(goBack));
setInterval(look, LOOK_MS / 2);
look();
