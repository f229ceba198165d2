// Whose exam it is: one exam, a free press that somebody chose on purpose, or nobody yet. The probe keeps the exams; this
// browser remembers only which one is open, and asks the probe for it anew after a reload.

import { fetchExam } from "../base/probe.js";
import { remember, remembered } from "../base/memory.js";
import { figure, say } from "../base/words.js";

let exam = null;
let isFree = false;
const listeners = [];

/** The exam that is open, with the version that is shown, or null. */
export const openExam = () => exam;
/** Whether somebody has said whose press it will be, be it nobody's. */
export const isChosen = () => exam !== null || isFree;
export const isFreeChosen = () => isFree;

/** Call back whenever it becomes another exam, or another version of it. */
export function onExam(act) {
  listeners.push(act);
}

function become(next, free) {
  exam = next;
  isFree = free;
  remember("exam", next?.id ?? null);
  for (const act of listeners) act();
}

export const open = (next) => become(next, false);
/** A free press is asked for anew after every reload: it is chosen, never left over. */
export const openFree = () => become(null, true);
export const finish = () => become(null, false);

/** Ask the probe for the exam that is open: as it is now, or none when it is gone. */
export async function refresh(id = exam?.id ?? remembered("exam")) {
  if (!id) return;
  try {
    const found = await fetchExam(id);
    if (found.version !== exam?.version || found.id !== exam?.id) become(found, false);
  } catch (error) {
    if (error.status === 404) finish();
    else throw error;
  }
}

/** Where the lesion of an exam is, in words. */
export function placeWords({ kind, side, clock_position: hour, nipple_distance_mm: mm }) {
  if (kind === "phantom") return "";
  if (!side || !hour) return say("exam.no_place");
  const told = { side: say(`side.${side}`), clock: hour, mm: mm === null ? "" : figure(mm, 0) };
  return say(mm === null ? "exam.place_no_mm" : "exam.place", told);
}

const NEAR_MM = 10; // distances from the nipple are said by hand

/** Whether two exams are of one lesion, as far as anybody has said: of one patient, side and hour, and no other distance. */
export function areOfOnePlace(one, other) {
  const isSame = ["kind", "patient_ref", "side", "clock_position"].every((name) => one?.[name] === other?.[name]);
  const [near, far] = [one, other].map((exam) => exam?.nipple_distance_mm ?? null);
  return isSame && (near === null || far === null || Math.abs(near - far) <= NEAR_MM);
}

/** Whose exam it is, in words. */
export const whoWords = (one) => (one.kind === "phantom" ? say("exam.phantom") : one.patient_ref);
