// Which measurement the screen shows: the newest of the open exam, one from the history, or an answer that the probe is
// still keeping. A result of somebody else is never shown under this exam's name: one from the history has its own.

import { fetchExam, fetchMeasurement, fetchMeasurementsOf } from "../base/probe.js";
import { openExam } from "../exam/current.js";
import { showRepeats } from "./repeats.js";
import { showKeptWarnings, showMeasurement } from "./result.js";

const ENDED_WITHOUT = new Set(["rejected", "cancelled", "failed"]);
let measurement = null;
let answer = null; // what the press says while the probe keeps it; from then on the measurement takes its place
let older = null;
let olderExam = null; // whose it is; null of a free press
let dismissed = null;
let repeatsAsked = 0;
let view = 0; // which look at the history it is: what was asked for in one before comes too late

function isOfThisExam(one) {
  return (one?.exam_id ?? null) === (openExam()?.id ?? null);
}

/** The measurement that is shown, the answer that is still being kept, or null. */
export function shownResult(status) {
  if (older) return older;
  // A press that came to nothing must not stand above the figures of the one before it.
  const wanted = status.step === "result" || (status.step === "ready" && !ENDED_WITHOUT.has(status.press?.state));
  const isNewest = measurement !== null && measurement.id === status.measurement_id;
  if (wanted && isNewest && measurement.id !== dismissed && isOfThisExam(measurement)) return measurement;
  return isOfThisExam(status.press) ? answer : null;
}

/** Whether the newest is nobody's, of a touch or another client, and stays in the history: an exam is open here. */
export const isFreeKept = ({ step, measurement_id: id }) => step === "result" && openExam() !== null
  && measurement?.id === id && measurement.exam_id === null && id !== dismissed;

export const isOlder = () => older !== null;
/** Whether what is shown is another exam's than the one that is open. */
export const isOfOther = () => older !== null && older.exam_id !== (openExam()?.id ?? null);
/** The exam of what is shown from the history, null of a free press. */
export const olderOwner = () => olderExam;
export const isMissing = ({ measurement_id: id }) => id !== null && id !== measurement?.id;

async function loadRepeats() {
  const mine = (repeatsAsked += 1);
  const exam = openExam();
  const found = exam ? await fetchMeasurementsOf(exam.id) : [];
  if (mine === repeatsAsked) showRepeats(found);
}

/** Say it of none: what is still on its way would be of what stood here before. */
function clearRepeats() {
  repeatsAsked += 1;
  showRepeats([]);
}

/** Draw what is measured now, unless one from the history is looked at: its figures must stand under its own name. */
async function drawNow() {
  const now = answer ?? measurement;
  if (older || !now) return;
  showMeasurement(now);
  await loadRepeats();
}

/** Load the newest measurement; it takes the place of its answer. */
export async function loadNewest(id) {
  measurement = await fetchMeasurement(id);
  answer = null;
  await drawNow();
}

/** Take over what another screen has changed of what is shown, and of how far the measurements of its exam agree. */
export async function refreshShown() {
  const mine = view;
  const [newest, shown] = await Promise.all([measurement, older].map((one) => one && fetchMeasurement(one.id)));
  if (newest && newest.id === measurement?.id && newest.version >= measurement.version) measurement = newest;
  if (shown && mine === view) await take(shown, mine);
  if (older) showMeasurement(older);
  else await drawNow();
}

/** Take a measurement from the history, with the exam that it is kept under now; not when something else is looked at
 * meanwhile, nor as it was before somebody has voided or moved it. */
async function take(found, mine) {
  const exam = found.exam_id === null ? null : await fetchExam(found.exam_id);
  if (mine !== view || (older?.id === found.id && older.version > found.version)) return;
  [older, olderExam] = [found, exam];
  showKeptWarnings(older.warnings);
}

/** Go back from the history to what is measured now, and draw that: its figures are not those that were looked at. */
function leaveHistory() {
  const now = answer ?? measurement;
  if (older && now) showMeasurement(now);
  view += 1;
  older = null;
  showKeptWarnings([]);
}

/** Show a measurement from the history. */
export async function showOlder(id) {
  const mine = (view += 1);
  await take(await fetchMeasurement(id), mine);
  if (mine !== view) return; // a press has begun, or another is looked at
  showMeasurement(older);
  clearRepeats();
}

/** Show the newest again, or nothing when it was put away. */
export async function showNow() {
  leaveHistory();
  await drawNow();
}

/** Put what is shown away: the next press comes. */
export function dismiss(status) {
  leaveHistory();
  clearRepeats();
  dismissed = status?.measurement_id ?? null;
}

/** Take over a measurement that somebody has moved or voided. */
export async function replace(after) {
  if (measurement?.id === after.id) measurement = after;
  if (older?.id !== after.id) return drawNow();
  await take(after, view);
  return older ? showMeasurement(older) : drawNow();
}

/** An answer stays in sight until its measurement is there; when it could not be kept, it is shown no more. */
export function followAnswer(status) {
  if (status.answer && answer === null && !older) showMeasurement(status.answer);
  const isBeingLoaded = status.step === "result" && measurement?.id !== status.measurement_id;
  answer = status.answer ?? (isBeingLoaded ? answer : null);
}
