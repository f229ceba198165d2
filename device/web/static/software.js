// The software's own page: which release runs, what became of the last update, and a release file from a stick.
// While an update is under way the main view says so, too, and keeps saying it while the daemon is away.

import { byId, setText } from "./dom.js";
import { fetchUpdates, goBack, sendRelease } from "./probe.js";

const UNDER_WAY = { waiting: "beginning", verifying: "checking its signature", unpacking: "unpacking", switching: "starting it", checking: "testing it" };
const LOOK_MS = 1000;
const GLANCE_MS = 5000; // while nobody looks at this page
const BEGINNING = "manifest.json"; // of every release file
const LOCAL = new Set(["127.0.0.1", "localhost", "[::1]"]);
const OTHERWISE = "A release file can be sent from the probe's own screen, with `make deploy` over ssh, or at its command line: python -m device update install FILE.";

const dialog = byId("releases");
let updates = null;
let sending = false;
let problem = "";
let lookedAt = -Infinity;
let asking = false;

const installing = (release) => (release ? `Version ${version(release)} is being installed.` : "A release is being installed.");
const version = (release) => (release ?? "").split("+")[0];
const isUnderWay = () => updates !== null && updates.state in UNDER_WAY;

/** What the main view says of an update under way, or null. */
export function updateLine() {
  if (!isUnderWay()) return null;
  const percent = updates.progress === null || updates.state === "waiting" ? "" : `, ${Math.round(100 * updates.progress)} %`;
  return { word: installing(updates.state === "waiting" ? null : updates.release), reason: `Now: ${UNDER_WAY[updates.state]}${percent}.`, tone: "caution" };
}

/** What to say while the daemon is away: title and sentence, null unless that is an update's doing. */
export function absenceWords() {
  if (!isUnderWay()) return null;
  const title = "The probe is being updated";
  return [title, "It comes back by itself within three minutes, with the new release or with the one before."];
}

function lineWords() {
  if (problem) return problem;
  if (sending) return "Reading the file.";
  return updateLine()?.word ?? updates?.outcome ?? "";
}

function showReleases() {
  const installed = updates !== null && updates.state !== "not_installed";
  setText(byId("releases-line"), lineWords());
  dialog.dataset.tone = problem ? "bad" : updates?.state === "rolled_back" || updates?.state === "refused" ? "caution" : "calm";
  setText(byId("release-running"), updates?.running ?? "");
  setText(byId("release-previous"), updates?.previous ?? "none");
  setText(byId("release-step"), isUnderWay() ? updates.step || UNDER_WAY[updates.state] : "");
  byId("release-progress").hidden = !(isUnderWay() || sending);
  if (isUnderWay() && updates.progress !== null) byId("release-progress").value = updates.progress;
  else byId("release-progress").removeAttribute("value");
  const mayChange = installed && LOCAL.has(location.hostname);
  byId("release-form").hidden = !mayChange;
  byId("release-file").disabled = sending || isUnderWay();
  byId("release-back").hidden = !updates?.can_roll_back;
  byId("release-back").disabled = sending || isUnderWay();
  setText(byId("release-back"), `Go back to ${version(updates?.previous)}`);
  setText(byId("release-hint"), updates === null || installed ? OTHERWISE : updates.reason);
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
  if (begins !== BEGINNING) throw new Error(`${file.name} is no release file: choose one that ends in .release.`);
  return sendRelease(file);
}

byId("releases-open").addEventListener("click", () => { problem = ""; dialog.showModal(); lookedAt = -Infinity; look(); });
byId("releases-close").addEventListener("click", () => dialog.close());
byId("release-file").addEventListener("change", ({ target }) => {
  const [file] = target.files;
  if (file) wish(() => send(file));
  target.value = ""; // the same file may be chosen again
});
byId("release-back").addEventListener("click", () => wish(goBack));
setInterval(look, LOOK_MS / 2);
look();
