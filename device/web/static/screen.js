// The probe's own screen: each status of the event stream becomes one instruction, a gauge, and at the end a result.
// The probe decides what happens next; this page keeps no procedure of its own and only shows what it is told.

import { ignoreBounces } from "./base/bounce.js";
import { sound, stayAwake, useComfort } from "./base/comfort.js";
import { byId, element, isEnabled, setAttribute, setEnabled, setText } from "./base/dom.js";
import { followFocus, keepFocus } from "./base/focus.js";
import { showIdentity } from "./base/menu.js";
import { cancelPress, fetchDevice, finishScan, followStatus, moveMeasurement, startPress, takeTare } from "./base/probe.js";
import { figure, reasonToKeep, say, sayPage } from "./base/words.js";
import { loadHospital } from "./exam/archive.js";
import { showBeside, useBeside } from "./exam/beside.js";
import { askToGoOn, askWhatIsScanned, chooseAnotherPlace, chooseExam, wantNone } from "./exam/chooser.js";
import { finish, isChosen, isFreeChosen, letRest, onExam, openExam, placeWords, refresh, whoWords } from "./exam/current.js";
import { openHistory, refreshHistory } from "./exam/history.js";
import { useKeyboard } from "./exam/keyboard.js";
import { askToMove } from "./exam/move.js";
import { followScanner } from "./exam/scanner.js";
import { askVoid } from "./exam/void.js";
import { openService, showFaults } from "./press/faults.js";
import { showGauge } from "./press/gauge.js";
import { endWords, guidanceWords, showInstruction, stepHint } from "./press/instruction.js";
import { showLive } from "./press/live_view.js";
import { asChosen, chosenMode, modeName, offerModes, onChoice, showModes } from "./press/modes.js";
import { chosenAccuracy, scanHint, scanTrouble, showAccuracy, showScan } from "./press/scan.js";
import { openDetails } from "./result/details.js";
import { describeMeasurement } from "./result/result.js";
import { dismiss, followAnswer, isFreeKept, isMissing, isOfOther, isOlder, loadNewest, olderOwner, refreshShown, replace, showNow, showOlder, shownResult } from "./result/shown.js";
import { showSelfTest } from "./service/self_test.js";
import { absenceWords, updateLine } from "./service/software.js";

const UNDER_WAY = new Set(["waiting", "capturing", "computing"]);
const STEP_INDEX = { reference: 0, lesion: 1, computing: 2, result: 2 };
const SOUNDS = {
  touch_lesion: "step", press_lesion: "step", move_aside: "step", lift: "good", done: "good", rejected: "caution", fault: "bad",
};
const AROUND = ["header", "beside", "footer"];
const RELOAD_MS = 1000;
const TOLD_MS = 6000;
const REST_CHECK_MS = 30000;

const panel = byId("panel");
const pressButton = byId("press-button");
const enoughButton = byId("enough-button");
const whyButton = byId("why-button");
let status = null;
let offersAreKnown = false;
let isLoaded = false; // whether the exam of before a reload has been asked for
let loading = false;
let sending = false;
let underCurtain = []; // dialogs that lay open when the connection was lost: what is typed there is not lost with it
let told = null; // {word, reason, tone, service}: what came of the last command
let service = ""; // the daemon's own words behind what is said now

const pressUnderWay = () => UNDER_WAY.has(status?.press?.state);
const shown = () => shownResult(status);
/** Whether nothing is under way and no result is shown: the next press may be chosen. */
const isIdle = () => ["ready", "result"].includes(status.step) && !pressUnderWay() && shown() === null;

/** Whose it is that stands below: what is shown from the history, and a press of another screen, are not of the open exam. */
function showWho() {
  const isElsewhere = pressUnderWay() && (status.press.exam_id ?? null) !== (openExam()?.id ?? null);
  const isOther = isElsewhere || isOfOther();
  const exam = isOther ? olderOwner() : openExam();
  const isFree = isFreeChosen() || (!exam && shown() !== null);
  const free = isOther || isFree ? say("exam.free") : say("exam.choose");
  const who = isElsewhere ? say("exam.elsewhere") : exam ? whoWords(exam) : free;
  setText(byId("exam-who"), who);
  setText(byId("exam-where"), isElsewhere ? say("hint.another_screen") : exam ? placeWords(exam) : "");
  byId("exam-button").dataset.who = isOther ? "other" : exam ? exam.kind : isFree ? "free" : "none";
}

function showSteps() {
  const isShown = shown() !== null;
  const current = isShown ? 2 : isIdle() ? -1 : STEP_INDEX[status.step] ?? -1;
  [...byId("steps").children].forEach((item, index) => {
    item.classList.toggle("step-done", index < current || (index === 2 && isShown));
    if (index === current) setAttribute(item, "aria-current", "step");
    else item.removeAttribute("aria-current");
  });
}

/** What to do between presses, by the mode that is chosen here; without an exam, to choose one. */
function guidanceNow() {
  const { code } = status.guidance;
  if (!isIdle()) return { code, words: guidanceWords(status) };
  if (!isChosen()) return { code: "choose", words: say("guidance.choose") };
  const first = asChosen(status).kind === "ramp" ? "touch_beside" : "press_beside";
  const wanted = ["touch_beside", "press_beside", "done"].includes(code) ? first : code;
  return { code: wanted, words: say(`guidance.${wanted}`) };
}

function hint() {
  if (isIdle() && !isChosen()) return say("hint.choose");
  const step = isIdle() ? "ready" : status.step;
  return scanHint({ ...status, step }, pressUnderWay() ? status.mode : chosenMode()) || stepHint({ ...status, step });
}

/** The line under the instruction: what came of a command first, then an update, the end of a press, and what helps. */
function lineNow() {
  if (told) return told;
  if (updateLine()) return updateLine();
  const end = endWords(status);
  if (end && status.step === "ready") return { ...end, word: `${end.word}.`, tone: "caution" };
  if (isFreeKept(status)) return { word: "", reason: say("result.free_kept"), tone: "caution" };
  if (scanTrouble(status)) return scanTrouble(status);
  return { word: "", reason: status.step === "fault" ? "" : hint(), tone: "calm" };
}

/** Instruction and line of a measurement that is shown. */
function sayResult(measurement) {
  const { word, reason, tone } = describeMeasurement(measurement);
  const line = told ?? updateLine() ?? { word: isOlder() ? `${say("result.older")}.` : "", reason, tone };
  showInstruction(tone === "good" ? "done" : "look", word, line);
  service = told?.service ?? "";
}

/** How the last press ended, where that comes before what to do next: at once, and where there may be no light. */
function endFirst() {
  const isDark = status.press?.state === "failed" && status.press.code?.startsWith("E2") && isIdle();
  return status.step === "rejected" || isDark ? endWords(status) : null;
}

function sayState() {
  const end = endFirst();
  const line = end && !told ? end : lineNow();
  service = line.service ?? "";
  if (!end) return showInstruction(guidanceNow().code, guidanceNow().words, line);
  const code = status.press.state === "cancelled" ? "cancelled" : "rejected";
  return showInstruction(code, end.word, { ...line, word: line === end ? "" : line.word, tone: "caution" });
}

function showProgress(seen) {
  const { frames_taken: taken, frames_needed: needed } = seen;
  const cells = byId("frame-cells");
  panel.style.setProperty("--progress", pressUnderWay() ? status.press.progress : 0);
  setText(byId("frames"), say("press.frames", { taken, needed }));
  const isTold = pressUnderWay() && !["idle", "done", "rejected"].includes(status.press_state);
  setText(byId("press-state"), isTold ? say(`state.${status.press_state}`) : "");
  if (cells.childElementCount !== needed) {
    cells.replaceChildren(...Array.from({ length: needed }, () => element("span", "")));
  }
  [...cells.children].forEach((cell, index) => cell.classList.toggle("taken", index < taken));
}

function pressWords(measurement) {
  if (pressUnderWay()) return say("press.cancel");
  if (isOfOther() && isChosen()) return say("press.back", { exam: openExam() ? whoWords(openExam()) : say("history.free") });
  if (status.step === "fault" && isChosen()) return say("press.try");
  if (!isChosen()) return say("exam.choose");
  if (status.simulated) return say("press.simulated");
  return say(measurement ? "press.again" : "press.new");
}

function showButtons(measurement) {
  const isBusy = status.step === "starting" || status.step === "self_test";
  setText(pressButton, pressWords(measurement));
  pressButton.classList.toggle("button-quiet", pressUnderWay());
  setEnabled(pressButton, !sending && !isBusy);
  enoughButton.hidden = !(status.scan && status.press?.state === "capturing");
  setEnabled(enoughButton, !sending);
  setEnabled(byId("tare"), !sending && !pressUnderWay() && status.step !== "self_test");
  whyButton.hidden = !service;
  // A hand that holds the probe must not press what it does not mean: all but this one button is out of reach.
  for (const id of AROUND) byId(id).inert = pressUnderWay();
}

/** What may be done with a result. While it is being kept, and while another is asked for, buttons wait in their places:
 * none moves under a finger, and none acts on what is about to go. */
function showActs(measurement) {
  const isKept = Boolean(measurement?.id);
  byId("act-void").hidden = Boolean(measurement?.voided);
  byId("act-file").hidden = !(isKept && openExam() && measurement.exam_id === null);
  byId("act-place").hidden = openExam()?.kind !== "patient" || isOlder();
  byId("act-finish").hidden = !isChosen() || isOlder();
  byId("act-mode").hidden = isOlder();
  byId("act-now").hidden = !isOlder();
  setText(byId("act-mode"), say("act.mode", { mode: chosenMode() ? modeName(chosenMode()) : "" }));
  for (const button of byId("result").querySelectorAll(".acts button")) setEnabled(button, isKept && !sending);
}

function show() {
  if (!status) return;
  const measurement = shown();
  const seen = pressUnderWay() ? status : asChosen(status);
  const isHere = status.step === "fault" && !isOlder();
  panel.dataset.step = status.step;
  panel.dataset.idle = isIdle();
  panel.dataset.view = measurement && !isHere ? "result" : "measure";
  byId("simulated-badge").hidden = !(status.simulated || measurement?.estimate.simulated);
  showIdentity(status);
  showWho();
  showSteps();
  if (panel.dataset.view === "result") sayResult(measurement);
  else sayState();
  showProgress(seen);
  showFaults(status, pressUnderWay());
  showButtons(measurement);
  showActs(measurement);
  showModes(!pressUnderWay());
  showAccuracy(!pressUnderWay() && chosenMode());
  showScan(status);
  showGauge(seen);
  showLive(pressUnderWay() && status.press.state !== "computing");
  showSelfTest(status);
  keepFocus(pressButton);
}

/** Ask the probe for what the page needs, one thing at a time; what failed is asked for again. */
async function load(fetchAndShow) {
  if (loading) return;
  loading = true;
  try {
    await fetchAndShow();
  } catch (error) {
    tellRefusal(error);
    await new Promise((done) => { setTimeout(done, RELOAD_MS); });
  } finally {
    loading = false;
  }
}

async function loadDevice() {
  const rested = (await refresh()) ?? (await letRest());
  if (rested) askToGoOn(rested);
  showBeside();
  offerModes(await fetchDevice());
  await loadHospital();
  offersAreKnown = isLoaded = true;
}

async function loadMeasurement() {
  await loadNewest(status.measurement_id);
  offersAreKnown = false; // this press has shown how long an answer takes here
  followAnswer(status);
  show();
}

function loadWhatIsMissing() {
  if (!offersAreKnown) load(loadDevice);
  else if (isMissing(status)) load(loadMeasurement);
}

function showConnection(lost) {
  const [title, words] = absenceWords() ?? [say("lost.title"), say("lost.words")];
  setText(byId("lost-title"), title);
  setText(byId("lost-words"), words);
  setAttribute(byId("lost-icon"), "href", absenceWords() ? "#icon-wait" : "#icon-fault");
  byId("connection-lost").dataset.tone = absenceWords() ? "caution" : "bad";
  byId("connection-lost").hidden = !lost;
  for (const id of ["main", ...AROUND]) byId(id).inert = lost || (id !== "main" && pressUnderWay());
  if (lost) underCurtain.push(...closeDialogs()); // they lie above everything
  else for (const dialog of underCurtain.splice(0)) dialog.showModal();
  if (lost) offersAreKnown = false; // whoever comes back may be another probe
}

function closeDialogs() {
  const open = [...document.querySelectorAll("dialog[open]")];
  for (const dialog of open) dialog.close();
  return open;
}

/** Say what came of a command; that it went well is said for some seconds. */
function tell(next) {
  told = next;
  show();
  if (next?.tone === "good") setTimeout(() => { if (told === next) tell(null); }, TOLD_MS);
}

/** Say why a command was refused; of what stands among the faults only that it still does. */
function tellRefusal({ message, code, service: words }) {
  if (status.faults.some((fault) => fault.code === code)) tell({ word: say("not_done"), reason: say("still", { code }), tone: "caution" });
  else tell({ word: say("not_done"), reason: message, tone: "caution", service: words });
}

/** What a new status changes beyond what it shows: sounds, the lock of the screen, dialogs out of the way. */
function follow(before, next) {
  const isNow = UNDER_WAY.has(next.press?.state);
  const began = isNow && !UNDER_WAY.has(before?.press?.state);
  if (began) {
    closeDialogs();
    underCurtain = [];
    wantNone();
    dismiss(next);
  }
  if (before && before.guidance.code !== next.guidance.code && SOUNDS[next.guidance.code]) sound(SOUNDS[next.guidance.code]);
  stayAwake(isNow);
}

function receive(next) {
  // After an update of the probe, the page that is already open must not stay the old one.
  if (status && status.release !== next.release) location.reload();
  if (status && status.step !== next.step) told = null;
  const isFirst = status === null;
  follow(status, next);
  status = next;
  showConnection(false);
  loadWhatIsMissing();
  followAnswer(status);
  show();
  if (isFirst) performance.mark("first status shown"); // for `make bench screen`
}

/** Show anew what this or another screen has changed of exams and measurements. */
function takeOverChanges() {
  showBeside();
  refreshHistory();
  refreshShown().then(show, () => {}); // who does not answer is asked again by the next change
}

/** Send one command at a time; a refusal takes the place of what was said of the one before. */
async function send(command) {
  if (sending) return;
  sending = true;
  told = null;
  show();
  try {
    await command();
  } catch (error) {
    tellRefusal(error);
  } finally {
    sending = false;
    show();
  }
}

/** Ask about an exam that was left open before anybody presses: the page of a panel is never loaded anew. */
async function askWhenRested() {
  if (pressUnderWay() || !byId("connection-lost").hidden) return;
  const rested = await letRest().catch(() => null); // who does not answer is asked again
  if (rested) askToGoOn(rested);
}

/** Start a press of what is shown here; when the exam has rested or is not as it is shown, nothing is pressed. */
async function start() {
  const exam = openExam();
  const rested = await letRest();
  if (rested) askToGoOn(rested);
  if (exam?.id !== openExam()?.id) return; // it has rested, or somebody has chosen another meanwhile
  const mode = chosenMode();
  const wish = mode ? { mode, ...chosenAccuracy(mode) } : {};
  try {
    await startPress(wish, openExam());
  } catch (error) {
    if (error.status !== 412) throw error;
    await refresh();
    tell({ word: say("not_done"), reason: say("exam.stale"), tone: "caution", service: error.service });
  }
}

async function tare() {
  const { moved_n: moved } = await takeTare();
  tell({ word: say("tare.word"), reason: say("tare.moved", { n: figure(moved, 3) }), tone: "good" });
}

/** Add a measurement to an exam, once somebody has said whose it is. */
async function file(measurement, exam, said = { by: exam.operator, reason: reasonToKeep("filed") }) {
  await replace(await moveMeasurement(measurement, { ...said, exam_id: exam.id }));
  tell({ word: "", reason: say("exam.filed", { patient: whoWords(exam) }), tone: "good" });
}

/** Show that a measurement is void; the question was answered, also when the connection was lost over it. */
function voided(after) {
  underCurtain = underCurtain.filter(({ id }) => id !== "void");
  send(() => replace(after));
}

function finishExam() {
  const exam = openExam();
  dismiss(status);
  finish();
  if (exam) tell({ word: "", reason: say("exam.finished", { patient: whoWords(exam) }), tone: "good" });
}

function onAct(id, does) {
  byId(id).addEventListener("click", () => { if (isEnabled(byId(id))) does(); });
}

/** A patient is scanned, whatever has the focus, unless it is the order's field: then the page asks which number it is. */
function scanned(code, field) {
  if (!byId("connection-lost").hidden) return; // under the curtain nothing is begun
  if (pressUnderWay()) tell({ word: "", reason: say("exam.scan_busy"), tone: "caution" });
  else if (field?.id === "order-number") askWhatIsScanned(code);
  else chooseExam(code);
}

pressButton.addEventListener("click", () => {
  if (!isEnabled(pressButton)) return;
  if (pressUnderWay()) send(() => cancelPress(status.press.id));
  else if (!isChosen()) chooseExam();
  else if (isOfOther()) send(showNow); // what stands there is not whose press it would be
  else send(start);
});
pressButton.addEventListener("keydown", (event) => { if (event.repeat) event.preventDefault(); });
enoughButton.addEventListener("click", () => { if (isEnabled(enoughButton)) send(() => finishScan(status.press.id)); });
whyButton.addEventListener("click", () => openService(service));
byId("tare").addEventListener("click", () => { if (isEnabled(byId("tare"))) send(tare); });
byId("exam-button").addEventListener("click", () => chooseExam());
byId("history-open").addEventListener("click", () => openHistory(openOlder));
onAct("act-details", () => openDetails(shown()));
onAct("act-void", () => askVoid(shown(), voided, (...asked) => send(() => file(...asked))));
onAct("act-file", () => askToMove(shown(), openExam(), (...asked) => send(() => file(...asked))));
onAct("act-mode", () => { dismiss(status); show(); });
onAct("act-place", chooseAnotherPlace);
onAct("act-finish", finishExam);
onAct("act-now", () => send(showNow));
onChoice(show);

const openOlder = (id) => send(() => showOlder(id));

let examShown = null;
onExam(() => {
  const id = openExam()?.id ?? null;
  const isReload = examShown === null && !isLoaded;
  if (id !== examShown && status) dismiss(isReload ? null : status);
  if (id !== examShown) underCurtain = []; // what lay or lies open is of the exam before
  if (id !== examShown && !isReload) closeDialogs();
  examShown = id;
  told = null; // it was said of another exam, or of another version
  show();
});
sayPage();
useComfort();
useKeyboard();
ignoreBounces(pressButton); // nor does a bounce cancel what the touch began
followFocus(pressButton);
followScanner(scanned);
useBeside(openOlder);
document.addEventListener("visibilitychange", askWhenRested);
setInterval(askWhenRested, REST_CHECK_MS);
followStatus(receive, () => showConnection(true), takeOverChanges);
