// Choose whose exam it is: scan or type a patient, go on with an exam, begin one at a place of the body, take a phantom,
// or press freely, which is asked twice. An exam that has rested is asked about, too.

import { button, byId, element, setText } from "../base/dom.js";
import { remember, remembered } from "../base/memory.js";
import { fetchExams, makeExam, makeExamElsewhere, makeOrderedExam } from "../base/probe.js";
import { say, spokenMoment } from "../base/words.js";
import { beginMap, chosenPlace } from "./body_map.js";
import { finish, hasRested, isChosen, open, openExam, openFree, placeWords, refresh, whoWords } from "./current.js";
import { examRow } from "./row.js";
import { nameWords, showOrdered } from "./worklist.js";

const RECENT = 12;
const KNOWN = 100; // newest exams among which a number in other capitals is looked for
const dialog = byId("chooser");
const fields = { patient_ref: byId("patient-ref"), order_number: byId("order-number"), operator: byId("operator") };
let sending = false;
let step = null; // of the hospital's worklist, whose exam it is to be
let wanted = null; // the exam of before that somebody has touched
let kept = null; // the exam that somebody is asked about
let like = null; // the exam whose patient and order it is to be of
let likeness = {}; // {patientRef, alike, toldOf}: the number that is like the typed one, and of which it was said
let unsorted = ""; // a number that was scanned, and that may be a patient's or an order's

/** Whoever goes on with something else has taken back that an exam of before was wanted: its late answer opens nothing. */
export function wantNone() {
  wanted = null;
}

function page(name) {
  wantNone();
  dialog.dataset.page = name;
  setText(byId("chooser-problem"), "");
}

/** A number whose hyphens break no line. */
const whole = (text) => text.replaceAll("-", "\u2011");

const typed = (name) => fields[name].value.trim();

function problem(key, values = {}) {
  setText(byId("chooser-problem"), say(key, values));
  return false;
}

function close() {
  if (dialog.open) dialog.close();
}

function take(exam) {
  open(exam);
  close();
}

/** Go on with an exam of before; one that has rested is asked about first. */
export async function goOn(exam) {
  wanted = exam;
  try {
    const isRested = await hasRested(exam);
    if (wanted !== exam) return; // another is wanted meanwhile, or none
    if (isRested) ask(exam);
    else take(exam);
  } catch (error) {
    if (wanted === exam) setText(byId("chooser-problem"), error.message);
  }
}

/** A number that has exams and differs from the typed one only in capitals, or null. */
async function numberAlike(patientRef) {
  if (!patientRef) return null;
  const written = [patientRef.toUpperCase(), patientRef.toLowerCase()].map((ref) => fetchExams({ patientRef: ref, limit: 1 }));
  const known = (await Promise.all([...written, fetchExams({ limit: KNOWN })])).flat().map(({ patient_ref: ref }) => ref);
  return known.find((ref) => ref !== patientRef && ref.toLowerCase() === patientRef.toLowerCase()) ?? null;
}

function takeAlike(alike) {
  fields.patient_ref.value = alike;
  setText(byId("chooser-problem"), "");
  typedByHand();
}

function likeRow(alike) {
  return button("recent recent-like", say("exam.alike", { number: whole(alike) }), () => takeAlike(alike));
}

/** Whether somebody has to be told once that the typed number has a known one beside it, before an exam is begun. */
function isToBeAsked() {
  const { patientRef, alike, toldOf } = likeness;
  if (step || !alike || patientRef !== typed("patient_ref") || toldOf === patientRef) return false;
  likeness.toldOf = patientRef;
  return true;
}

/** Show the exams of before: of the patient that is typed, else the newest of all. */
async function showRecent() {
  const patientRef = typed("patient_ref") || null;
  const [found, alike] = await Promise.all([
    fetchExams({ patientRef, limit: RECENT }).catch(() => []),
    numberAlike(patientRef).catch(() => null),
  ]);
  if ((typed("patient_ref") || null) !== patientRef) return;
  likeness = { ...likeness, patientRef, alike };
  const rows = alike ? [likeRow(alike)] : [];
  byId("recent").replaceChildren(...rows, ...(found.length ? found.map((exam) => examRow(exam, goOn)) : [element("p", "", say("exam.recent_none"))]));
}

/** Take a step of the worklist: patient and order are those that were ordered. */
function chooseStep(chosen) {
  step = chosen;
  like = null;
  fields.patient_ref.value = step.patient_ref;
  fields.order_number.value = step.order_number;
  showRecent();
  toMap();
}

/** What is typed by hand is no step of the worklist any more, nor of the exam before. */
function typedByHand() {
  wantNone();
  step = like = null;
  showRecent();
}

/** Another patient has not the order of the one before. */
function patientTyped() {
  fields.order_number.value = "";
  typedByHand();
}

/** Open the page, with a patient who was scanned or without. */
export function chooseExam(patient = "") {
  page("who");
  step = like = null;
  fields.patient_ref.value = patient;
  fields.order_number.value = "";
  fields.operator.value ||= remembered("operator") ?? "";
  setText(byId("scanned"), patient ? say("exam.scanned", { patient }) : say("exam.patient_hint"));
  if (!dialog.open) dialog.showModal();
  showRecent();
  showOrdered(patient, chooseStep);
}

/** Ask whether to go on with an exam that was open here and has rested; who is choosing already is not asked. */
export function askToGoOn(exam) {
  if (!dialog.open) ask(exam);
}

function ask(exam) {
  kept = exam;
  page("kept");
  const patient = whole(whoWords(exam));
  setText(byId("kept-sure"), say("exam.kept_sure", { patient, at: spokenMoment(exam.made_at) }));
  setText(byId("kept-where"), placeWords(exam));
  setText(byId("kept-yes"), say("exam.kept_yes", { patient }));
  if (!dialog.open) dialog.showModal();
  byId("kept-no").focus(); // Enter by accident goes on with nobody
}

/** Ask whose number it is that was scanned while the order's field had the focus. */
export function askWhatIsScanned(code) {
  unsorted = code;
  page("scan");
  setText(byId("scan-sure"), say("exam.scan_sure", { code: whole(code) }));
  byId("scan-patient").focus(); // nothing is begun by it, and the number is seen on the next page
}

function takeAsOrder() {
  fields.order_number.value = unsorted;
  typedByHand();
  page("who");
}

/** Let the exam of before go, and ask whose it is; one that was open all the while stays open. */
function forgetKept() {
  if (!isChosen()) finish();
  chooseExam();
}

/** Open the map for another place of the patient whose exam is open. */
export function chooseAnotherPlace() {
  like = openExam();
  const { patient_ref: patient, order_number: order, operator } = like;
  Object.assign(fields.patient_ref, { value: patient });
  Object.assign(fields.order_number, { value: order ?? "" });
  Object.assign(fields.operator, { value: operator });
  step = null;
  if (!dialog.open) dialog.showModal();
  showMap();
}

function showMap() {
  page("where");
  const patient = like ? whoWords(like) : step ? nameWords(step) : typed("patient_ref");
  setText(byId("where-of"), say("exam.where_of", { patient: whole(patient) }));
  beginMap({}, () => setText(byId("chooser-problem"), "")); // what was missing may be there now
}

function toMap() {
  if (!typed("patient_ref")) return problem("exam.missing_patient");
  if (!typed("operator")) return problem("exam.missing_operator");
  if (isToBeAsked()) return problem("exam.alike", { number: whole(likeness.alike) });
  remember("operator", typed("operator"));
  return showMap();
}

async function begin(made) {
  if (sending) return;
  sending = true;
  try {
    const exam = await made();
    if (exam.own_study) tellApart(exam);
    else take(exam);
  } catch (error) {
    if ((step || like) && error.status === 404) chooseAgain();
    else if (like && error.status === 412) await showAnew();
    else setText(byId("chooser-problem"), error.message);
  } finally {
    sending = false;
  }
}

/** Open an exam, and say that it is not in the study that was ordered: somebody has to tell the archive. */
function tellApart(exam) {
  open(exam); // which closes what lies open
  page("apart");
  dialog.showModal();
  byId("apart-yes").focus();
}

/** A step is none any more: ask the hospital again, and keep nothing of it that could be taken for typed by hand. */
function chooseAgain() {
  chooseExam();
  problem("worklist.gone");
}

/** The exam whose patient it is to be was changed meanwhile: ask for the place anew, of who it is now. */
async function showAnew() {
  await refresh();
  if (openExam()) chooseAnotherPlace();
  else chooseExam();
  problem("exam.stale");
}

function beginPatient() {
  const place = chosenPlace();
  if (!place.side || !place.clock_position) return problem("exam.missing_place");
  const who = { kind: "patient", patient_ref: typed("patient_ref"), operator: typed("operator") };
  if (like) return begin(() => makeExamElsewhere(like, { operator: typed("operator"), ...place }));
  if (step) return begin(() => makeOrderedExam({ step: step.id, operator: typed("operator"), ...place }));
  return begin(() => makeExam({ ...who, order_number: typed("order_number") || null, ...place }));
}

function beginPhantom() {
  if (!typed("operator")) return problem("exam.missing_operator");
  remember("operator", typed("operator"));
  step = like = null;
  return begin(() => makeExam({ kind: "phantom", operator: typed("operator") }));
}

fields.patient_ref.addEventListener("input", patientTyped);
fields.order_number.addEventListener("input", typedByHand);
byId("begin-exam").addEventListener("click", beginPatient);
byId("begin-phantom").addEventListener("click", beginPhantom);
byId("free-press").addEventListener("click", () => page("free"));
byId("free-yes").addEventListener("click", () => { openFree(); close(); });
byId("apart-yes").addEventListener("click", close);
byId("scan-patient").addEventListener("click", () => chooseExam(unsorted));
byId("scan-order").addEventListener("click", takeAsOrder);
byId("kept-yes").addEventListener("click", () => take(kept));
byId("kept-no").addEventListener("click", forgetKept);
for (const one of dialog.querySelectorAll(".to-who")) one.addEventListener("click", () => page("who"));
byId("chooser-close").addEventListener("click", close);
dialog.addEventListener("close", wantNone);
byId("who-form").addEventListener("submit", (event) => { event.preventDefault(); toMap(); });
