// Whose exam it is: one exam, a free press that somebody chose on purpose, or nobody yet. The probe keeps the exams; this
// browser remembers only which one is open, and asks the probe for it anew after a reload. One that has rested is not open
// any more until somebody says so, after a reload or without one: the next who presses here may have another patient.

import { fetchExam, fetchNewestPress } from "../base/probe.js";
import { remember, remembered } from "../base/memory.js";
import { figure, say } from "../base/words.js";

const RESTED_MS = 2 * 3600000; // longer than any exam with its pauses, shorter than from a morning's patient to an afternoon's
let exam = null;
let usedAt = null; // when the exam was last pressed in or said to be whose it is, as far as this page knows
let askedId = null; // of the exam that somebody was asked about since the reload
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

function tell() {
  for (const act of listeners) act();
}

function become(next, free) {
  exam = next;
  isFree = free;
  remember("exam", next?.id ?? null);
  tell();
}

function openAsOf(next, at) {
  usedAt = at;
  become(next, false);
}

/** Open the exam that somebody says it is, now. */
export const open = (next) => openAsOf(next, new Date());
/** A free press is asked for anew after every reload: it is chosen, never left over. */
export const openFree = () => become(null, true);
export const finish = () => become(null, false);

/** Whether that is long ago, or not on this day; by a clock that is far off it is, too. */
function isLongAgo(at) {
  const now = new Date();
  return at.toDateString() !== now.toDateString() || Math.abs(now - at) > RESTED_MS;
}

/** When an exam was last pressed in on any screen, or begun, whichever is later. */
async function lastUse({ id, made_at: madeAt }) {
  const press = await fetchNewestPress(id);
  return new Date(Math.max(Date.parse(madeAt), press ? Date.parse(press.asked_at) : -Infinity));
}

/** Whether an exam that somebody wants to go on with has rested; the one that is open is asked about in time. */
export const hasRested = async (one) => one.id !== exam?.id && isLongAgo(await lastUse(one));

/** Find out whether to go on with the exam of before a reload; return it when somebody is to be asked. */
async function reopen(id) {
  if (id === askedId) return null;
  const found = await fetchExam(id);
  const last = await lastUse(found);
  if (isChosen()) return null; // somebody has said it meanwhile
  askedId = isLongAgo(last) ? id : null;
  if (askedId) return found;
  openAsOf(found, last);
  return null;
}

/** Let the open exam go when nobody has pressed in it for long, here or elsewhere; return it when somebody is to be asked.
 * Which one it was stays remembered: after a reload it is asked about again. */
export async function letRest() {
  const left = exam;
  if (left === null || !isLongAgo(usedAt)) return null;
  const last = await lastUse(left);
  if (left.id !== exam?.id) return null; // somebody has said another meanwhile
  usedAt = last;
  if (!isLongAgo(last)) return null;
  askedId = left.id;
  exam = null;
  tell();
  return left;
}

/** Ask the probe for the exam that is open: as it is now, or none when it is gone. Return one that somebody is asked about.
 * Whoever has finished it or chosen another while the probe was asked is right: an answer opens and closes nothing else. */
export async function refresh() {
  const id = exam?.id ?? remembered("exam");
  if (!id) return null;
  try {
    if (!exam) return await reopen(id);
    const asked = exam;
    const found = await fetchExam(id);
    if (exam === asked && found.version !== asked.version) become(found, false);
  } catch (error) {
    if (error.status !== 404) throw error;
    if ((exam?.id ?? remembered("exam")) === id) finish();
  }
  return null;
}

/** Where the lesion of an exam is, in words. */
export function placeWords({ kind, side, clock_position: hour, nipple_distance_mm: mm }) {
  if (kind === "phantom") return "";
  if (!side || !hour) return say("exam.no_place");
  const told = { side: say(`side.${side}`), clock: hour, mm: mm === null ? "" : figure(mm, 0) };
  return say(mm === null ? "exam.place_no_mm" : "exam.place", told);
}

const NEAR_MM = 10; // distances from the nipple are said by hand

/** Whether two exams are of one patient: of one number by one issuer, or both of no known one. Two issuers may give one
 * number to two people. */
export const areOfOnePatient = (one, other) => ["kind", "patient_ref", "patient_issuer"].every((name) => one?.[name] === other?.[name]);

/** Whether two exams are of one lesion, as far as anybody has said: of one patient, side and hour, and no other distance. */
export function areOfOnePlace(one, other) {
  const isSame = areOfOnePatient(one, other) && ["side", "clock_position"].every((name) => one?.[name] === other?.[name]);
  const [near, far] = [one, other].map((exam) => exam?.nipple_distance_mm ?? null);
  return isSame && (near === null || far === null || Math.abs(near - far) <= NEAR_MM);
}

/** A patient in words: the number, and who has issued it, where that is known. */
export const patientWords = ({ patient_ref: ref, patient_issuer: issuer }) => (issuer ? say("exam.issued", { number: ref, issuer }) : ref);

/** Whose exam it is, in words. */
export const whoWords = (one) => (one.kind === "phantom" ? say("exam.phantom") : patientWords(one));
