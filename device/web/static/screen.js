// The probe's own screen: each status of the event stream becomes one instruction, a gauge, and at the end a result.
// The probe decides what happens next; this page keeps no procedure of its own and only shows what it is told.

import { byId, element, setAttribute, setText } from "./dom.js";
import { showGauge } from "./gauge.js";
import { chosenMode, offerModes, showModes } from "./modes.js";
import {
  cancelPress, fetchDevice, fetchMeasurement, finishScan, followStatus, startPress, takeTare,
} from "./probe.js";
import { describeMeasurement, showMeasurement } from "./result.js";
import { chosenAccuracy, scanHint, scanTrouble, showAccuracy, showScan } from "./scan.js";
import { showSelfTest } from "./self_test.js";
import { absenceWords, updateLine } from "./software.js";

const UNDER_WAY = new Set(["waiting", "capturing", "computing"]);
const STEP_INDEX = { reference: 0, lesion: 1, computing: 2, result: 2 };
const ICONS = {
  press_beside: "press", press_lesion: "press", press_harder: "harder", press_lighter: "lighter",
  touch_beside: "press", touch_lesion: "press", move_aside: "aside", press_slowly: "harder", slower: "wait",
  keep_free: "lift", hold_block: "press", put_weight: "press", take_weight_off: "lift",
  hold_still: "hold", lift: "lift", done: "done", rejected: "rejected", fault: "fault",
};
const WAIT_ICONS = { ready: "press" };
const TONES = { hold_still: "good", slower: "caution", done: "good", rejected: "caution", fault: "bad" };
const STEP_HINTS = {
  starting: "The probe starts and checks its parts.",
  ready: "Two presses make a measurement: one beside the lesion, then one on it.",
  reference: "Reference press: on plain tissue beside the lesion.",
  lesion: "Lesion press: on the lesion, with the same force.",
  computing: "Computing size, depth and Young's modulus.",
  self_test: "The probe tests its parts.",
};
const RAMP_HINTS = {
  reference: "Reference press: slowly harder, on plain tissue beside the lesion.",
  lesion: "Lesion press: slowly harder, on the lesion.",
};
const PRESS_WORDS = { rejected: "Rejected.", cancelled: "Cancelled.", failed: "Failed." };
const LONG_INSTRUCTION = 40; // characters; more would need a third line
const RELOAD_MS = 1000;
const TOLD_MS = 5000;

const panel = byId("panel");
const button = byId("press-button");
const enoughButton = byId("enough-button");
const tareButton = byId("tare");
const LOST_WORDS = [byId("lost-title").textContent, byId("lost-words").textContent];
let status = null;
let measurement = null;
let answer = null; // what the press says while the probe keeps it; from then on the measurement takes its place
let offersAreKnown = false;
let loading = false;
let sending = false;
let problem = "";
let tared = "";
let faultsShown = "";

const pressUnderWay = () => UNDER_WAY.has(status?.press?.state);

/** The measurement that is shown, the answer that is still being kept, or null. */
function shownResult() {
  // A press that came to nothing must not stand above the figures of the one before it.
  const wanted = status.step === "result" || (status.step === "ready" && !PRESS_WORDS[status.press?.state]);
  if (wanted && measurement !== null && measurement.id === status.measurement_id) return measurement;
  return answer;
}

function showIdentity() {
  setText(byId("serial"), status.serial);
  setText(byId("software"), `Software ${status.software}`);
  byId("simulated-badge").hidden = !(status.simulated || shownResult()?.estimate.simulated);
}

function showSteps() {
  const isShown = shownResult() !== null;
  const current = isShown ? 2 : STEP_INDEX[status.step] ?? -1;
  [...byId("steps").children].forEach((item, index) => {
    item.classList.toggle("step-done", index < current || (index === 2 && isShown));
    if (index === current) setAttribute(item, "aria-current", "step");
    else item.removeAttribute("aria-current");
  });
}

function showInstruction() {
  const { code, text } = status.guidance;
  setText(byId("instruction"), text.replace(/(\d) (?=mm\b)/, "$1\u00a0"));
  setAttribute(byId("instruction-icon"), "href", `#icon-${ICONS[code] ?? WAIT_ICONS[status.step] ?? "wait"}`);
  byId("instruction").classList.toggle("long", text.length > LONG_INSTRUCTION);
  panel.dataset.tone = TONES[code] ?? "calm";
}

/** The one sentence under the instruction: a refused command first, then what became of the press, then the result. */
function describeStatus() {
  const scan = scanHint(status, pressUnderWay() ? status.mode : chosenMode());
  const hint = scan || (status.kind === "ramp" && RAMP_HINTS[status.step]) || (STEP_HINTS[status.step] ?? "");
  const pressWord = PRESS_WORDS[status.press?.state];
  if (problem) return { word: "Not done.", reason: problem, tone: "caution" };
  if (updateLine()) return updateLine();
  if (tared) return { word: "Tared.", reason: tared, tone: "good" };
  if (pressWord) return { word: pressWord, reason: status.press.reason || hint, tone: "caution" };
  if (scanTrouble(status)) return scanTrouble(status);
  if (shownResult()) return describeMeasurement(shownResult());
  return { word: "", reason: hint, tone: "calm" };
}

function showStatusLine() {
  const { word, reason, tone } = describeStatus();
  setText(byId("status-word"), word);
  setText(byId("status-reason"), reason);
  byId("status-line").dataset.tone = tone;
}

function showProgress() {
  const { frames_taken: taken, frames_needed: needed } = status;
  const cells = byId("frame-cells");
  panel.style.setProperty("--progress", pressUnderWay() ? status.press.progress : 0);
  setText(byId("frames"), `${taken} of ${needed} frames`);
  setText(byId("press-state"), pressUnderWay() ? status.press_state.replaceAll("_", " ") : "");
  if (cells.childElementCount !== needed) {
    cells.replaceChildren(...Array.from({ length: needed }, () => element("span", "")));
  }
  [...cells.children].forEach((cell, index) => cell.classList.toggle("taken", index < taken));
}

function faultItem({ code, title, severity, cause, remedy }) {
  const item = element("div", "fault");
  item.dataset.severity = severity;
  const words = element("p", "fault-words");
  words.append(element("strong", "fault-cause", cause), " ", element("span", "fault-remedy", remedy));
  const name = element("p", "fault-name");
  name.append(element("span", "fault-code", code), element("span", "fault-title", title));
  item.append(name, words);
  return item;
}

function showFaults() {
  const key = JSON.stringify(status.faults);
  if (key === faultsShown) return;
  faultsShown = key;
  byId("faults").replaceChildren(...status.faults.map(faultItem));
  byId("faults").hidden = status.faults.length === 0;
  panel.classList.toggle("with-faults", status.faults.length > 0);
}

/** What is asked for: a mode, and of a scan how sure it is to be. */
function wish() {
  const mode = chosenMode();
  return mode ? { mode, ...chosenAccuracy(mode) } : {};
}

function showButton() {
  const start = status.simulated ? "Press the simulated probe" : "New measurement";
  setText(button, pressUnderWay() ? "Cancel" : start);
  button.classList.toggle("button-cancel", pressUnderWay());
  enoughButton.hidden = !(status.scan && status.press?.state === "capturing");
  enoughButton.disabled = sending;
  button.disabled = sending || status.step === "starting" || status.step === "self_test";
  tareButton.disabled = sending || pressUnderWay() || status.step === "self_test";
}

function show() {
  panel.dataset.step = status.step;
  panel.dataset.view = shownResult() ? "result" : "measure";
  showIdentity();
  showSteps();
  showInstruction();
  showStatusLine();
  showProgress();
  showFaults();
  showButton();
  showModes(!pressUnderWay());
  showAccuracy(!pressUnderWay() && chosenMode());
  showScan(status);
  showGauge(status);
  showSelfTest(status);
}

/** Ask the probe for what the page needs, one thing at a time; what failed is asked for again. */
async function load(fetchAndShow) {
  if (loading) return;
  loading = true;
  try {
    await fetchAndShow();
    problem = "";
  } catch (error) {
    problem = error.message;
    await new Promise((done) => { setTimeout(done, RELOAD_MS); });
  } finally {
    loading = false;
  }
}

async function loadDevice() {
  offerModes(await fetchDevice());
  offersAreKnown = true;
}

async function loadMeasurement() {
  measurement = await fetchMeasurement(status.measurement_id);
  showMeasurement(measurement);
  offersAreKnown = false; // this press has shown how long an answer takes here
  showAnswer();
  show();
}

function loadWhatIsMissing() {
  if (!offersAreKnown) load(loadDevice);
  else if (status.measurement_id !== null && status.measurement_id !== measurement?.id) load(loadMeasurement);
}

/** An answer stays in sight until its measurement is there; when it could not be kept, it is shown no more. */
function showAnswer() {
  if (status.answer && answer === null) showMeasurement(status.answer);
  const isBeingLoaded = status.step === "result" && measurement?.id !== status.measurement_id;
  answer = status.answer ?? (isBeingLoaded ? answer : null);
}

function showConnection(lost) {
  const [title, words] = absenceWords() ?? LOST_WORDS;
  setText(byId("lost-title"), title);
  setText(byId("lost-words"), words);
  setAttribute(byId("lost-icon"), "href", absenceWords() ? "#icon-wait" : "#icon-fault");
  byId("connection-lost").dataset.tone = absenceWords() ? "caution" : "bad";
  byId("connection-lost").hidden = !lost;
  byId("main").inert = lost;
  if (lost) for (const id of ["self-test", "releases"]) byId(id).close(); // they lie above everything
  if (lost) offersAreKnown = false; // whoever comes back may be another probe
}

function receive(next) {
  // After an update of the probe, the page that is already open must not stay the old one.
  if (status && status.release !== next.release) location.reload();
  if (status && status.step !== next.step) problem = tared = "";
  status = next;
  showConnection(false);
  loadWhatIsMissing();
  showAnswer();
  show();
}

/** Send one command at a time; a refusal takes the place of what was said of the one before. */
async function send(command) {
  sending = true;
  problem = tared = "";
  button.disabled = enoughButton.disabled = tareButton.disabled = true;
  try {
    await command();
  } catch (error) {
    problem = error.message;
  } finally {
    sending = false;
  }
}

button.addEventListener("click", () => {
  send(() => (pressUnderWay() ? cancelPress(status.press.id) : startPress(wish())));
});
enoughButton.addEventListener("click", () => send(() => finishScan(status.press.id)));
tareButton.addEventListener("click", () => {
  send(async () => {
    tared = `The zero has moved by ${(await takeTare()).moved_n.toFixed(3)} N.`;
    setTimeout(() => { tared = ""; }, TOLD_MS);
  });
});

followStatus(receive, () => showConnection(true));
