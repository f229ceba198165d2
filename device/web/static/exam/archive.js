// An exam on its way to the hospital's archive: a button that sends it, and how far each of its objects is. Shown where an
// archive is set; nothing is ever sent that nobody has sent.

import { button, byId, element, setEnabled, setText } from "../base/dom.js";
import { remembered } from "../base/memory.js";
import { fetchHospital, fetchSent, sendToArchive } from "../base/probe.js";
import { clock, say } from "../base/words.js";
import { openExam, refresh } from "./current.js";

const LOOK_MS = 2000;
const GLANCE_MS = 5000; // while nothing is on its way: another screen may send it
const ON_ITS_WAY = new Set(["queued", "sent"]);
const TAKEN_BACK = new Set(["withdrawn", "recalled"]);
const box = byId("archive");
const state = element("p", "archive-state");
const sendButton = button("button button-quiet", "", send);
let hospital = null;
let shown = null; // the exam whose way is shown
let counting = []; // the ids of its measurements that count
let missing = new Set(); // those that cannot be sent any more, as the probe has said of the last exam that was sent
let looking = null;
let asked = 0;

state.setAttribute("role", "status");
sendButton.id = "archive-send";
box.append(sendButton, state);

/** Ask the probe whether there are an archive and a worklist; who may not ask has none. */
export async function loadHospital() {
  hospital = await fetchHospital().catch(() => null);
}

export const hasWorklist = () => Boolean(hospital?.worklist);

const count = (objects, one) => objects.filter(({ state: is }) => is === one).length;

/** Images and reports; a note that one of them is not to be used is none. */
const ofContent = (objects) => objects.filter(({ kind }) => kind !== "rejection");

/** Which measurements that count nobody has sent since they were taken, moved here or corrected. */
function unsent(objects) {
  const there = new Set(ofContent(objects).filter(({ state: is }) => !TAKEN_BACK.has(is)).map(({ measurement_id: id }) => id));
  return counting.filter((id) => !there.has(id));
}

/** What has become of an exam, in words: what is wrong first, then what is under way, then what is done. */
function words(objects, { fault, next_try_at: next }) {
  const n = objects.length;
  const left = unsent(objects);
  if (n === 0) return say("archive.not_sent");
  if (count(objects, "refused")) return say("archive.refused", { some: count(objects, "refused"), n });
  if (count(objects, "queued") && fault) return say("archive.waits", { at: next ? clock(next) : "–" });
  if (count(objects, "queued")) return say("archive.queued", { some: count(objects, "queued"), n });
  if (left.length && left.every((id) => missing.has(id))) return say("archive.missing", { n: left.length, all: counting.length });
  if (left.length) return say("archive.unsent", { n: left.length, all: counting.length });
  if (count(objects, "sent")) return say("archive.sent");
  const confirmed = count(ofContent(objects), "confirmed");
  return confirmed ? say("archive.confirmed", { some: confirmed }) : say("archive.taken_back");
}

function tell(text, tone = "calm") {
  setText(state, text);
  state.dataset.tone = tone;
}

function show(objects) {
  const isWrong = objects.some(({ state: is }) => is === "refused") || (objects.length > 0 && unsent(objects).length > 0);
  tell(words(objects, hospital), isWrong ? "caution" : "calm");
  box.hidden = !counting.length && !objects.length;
  setText(sendButton, say(objects.length ? "archive.again" : "archive.send"));
  setEnabled(sendButton, !objects.some(({ state: is }) => is === "queued"));
  clearTimeout(looking);
  looking = setTimeout(look, objects.some(({ state: is }) => ON_ITS_WAY.has(is)) ? LOOK_MS : GLANCE_MS);
}

const isShown = (exam) => exam.id === shown?.id;

/** Ask how far the exam is, and again while something is on its way and somebody looks. */
async function look() {
  if (!shown || !byId("history").open) return;
  const [exam, mine] = [shown, (asked += 1)];
  const isLate = () => mine !== asked || !isShown(exam); // what is asked for later knows more
  try {
    const [sent] = await Promise.all([fetchSent(exam.id), loadHospital()]);
    if (!isLate() && hospital) show(sent.objects);
  } catch (error) {
    if (isLate()) return;
    tell(error.message, "caution");
    looking = setTimeout(look, LOOK_MS);
  }
}

async function send() {
  if (sendButton.getAttribute("aria-disabled") === "true") return;
  setEnabled(sendButton, false);
  const exam = shown;
  try {
    const queued = await sendToArchive(exam, exam.operator || remembered("operator"));
    if (!isShown(exam)) return; // it is on its way, and another one is looked at
    asked += 1; // whoever looked before may not have seen it
    missing = new Set(queued.missing.map(({ measurement_id: id }) => id));
    show(queued.objects);
  } catch (error) {
    if (error.status === 412) await refresh();
    if (!isShown(exam)) return;
    tell(error.status === 412 ? say("archive.stale") : error.message, "caution");
    setEnabled(sendButton, true);
    shown = openExam();
  }
}

/** Show how far the open exam is, if there is an archive; phantoms are not sent, nor what counts nothing and never was, nor
 * simulated presses, unless the probe is to send them. */
export function showArchive(isOfExam, measurements) {
  const exam = openExam();
  const before = shown?.id;
  clearTimeout(looking);
  const valid = measurements.filter(({ voided }) => !voided);
  counting = valid.map(({ id }) => id);
  const areReal = hospital?.send_phantoms || !valid.some(({ estimate }) => estimate.simulated);
  shown = hospital?.archive && isOfExam && exam?.kind === "patient" && areReal ? exam : null;
  box.hidden = !shown || !counting.length;
  if (!shown) return;
  if (shown.id === before) return look();
  setText(sendButton, say("archive.send"));
  tell(say("archive.asking"));
  return look();
}
