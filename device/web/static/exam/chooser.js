// Choose whose exam it is: scan or type a patient, go on with an exam, begin one at a place of the body, take a phantom,
// or press freely, which is asked twice.

import { byId, element, setText } from "../base/dom.js";
import { remember, remembered } from "../base/memory.js";
import { fetchExams, makeExam, makeOrderedExam } from "../base/probe.js";
import { say } from "../base/words.js";
import { beginMap, chosenPlace } from "./body_map.js";
import { open, openExam, openFree } from "./current.js";
import { examRow } from "./row.js";
import { nameWords, showOrdered } from "./worklist.js";

const RECENT = 12;
const dialog = byId("chooser");
const fields = { patient_ref: byId("patient-ref"), order_number: byId("order-number"), operator: byId("operator") };
let sending = false;
let step = null; // of the hospital's worklist, whose exam it is to be
const stepsOf = new Map(); // of exams that were begun by one

function page(name) {
  dialog.dataset.page = name;
  setText(byId("chooser-problem"), "");
}

/** A number whose hyphens break no line. */
const whole = (text) => text.replaceAll("-", "\u2011");

const typed = (name) => fields[name].value.trim();

function problem(key) {
  setText(byId("chooser-problem"), say(key));
  return false;
}

function close() {
  if (dialog.open) dialog.close();
}

function goOn(exam) {
  open(exam);
  close();
}

/** Show the exams of before: of the patient that is typed, else the newest of all. */
async function showRecent() {
  const patientRef = typed("patient_ref") || null;
  const found = await fetchExams({ patientRef, limit: RECENT }).catch(() => []);
  if ((typed("patient_ref") || null) !== patientRef) return;
  byId("recent").replaceChildren(...(found.length ? found.map((exam) => examRow(exam, goOn)) : [element("p", "", say("exam.recent_none"))]));
}

/** Take a step of the worklist: patient and order are those that were ordered. */
function chooseStep(chosen) {
  step = chosen;
  fields.patient_ref.value = step.patient_ref;
  fields.order_number.value = step.order_number;
  showRecent();
  toMap();
}

/** What is typed by hand is no step of the worklist any more. */
function typedByHand() {
  step = null;
  showRecent();
}

/** Open the page, with a patient who was scanned or without. */
export function chooseExam(patient = "") {
  page("who");
  step = null;
  fields.patient_ref.value = patient;
  fields.order_number.value = "";
  fields.operator.value ||= remembered("operator") ?? "";
  setText(byId("scanned"), patient ? say("exam.scanned", { patient }) : say("exam.patient_hint"));
  if (!dialog.open) dialog.showModal();
  showRecent();
  showOrdered(patient, chooseStep);
}

/** Open the map for another place of the patient whose exam is open. */
export function chooseAnotherPlace() {
  const { patient_ref: patient, order_number: order, operator } = openExam();
  Object.assign(fields.patient_ref, { value: patient });
  Object.assign(fields.order_number, { value: order ?? "" });
  Object.assign(fields.operator, { value: operator });
  step = stepsOf.get(openExam().id) ?? null;
  if (!dialog.open) dialog.showModal();
  showMap();
}

function showMap() {
  page("where");
  setText(byId("where-of"), say("exam.where_of", { patient: whole(step ? nameWords(step) : typed("patient_ref")) }));
  beginMap({}, () => setText(byId("chooser-problem"), "")); // what was missing may be there now
}

function toMap() {
  if (!typed("patient_ref")) return problem("exam.missing_patient");
  if (!typed("operator")) return problem("exam.missing_operator");
  remember("operator", typed("operator"));
  return showMap();
}

async function begin(made) {
  if (sending) return;
  sending = true;
  try {
    const exam = await made();
    if (step) stepsOf.set(exam.id, step);
    goOn(exam);
  } catch (error) {
    setText(byId("chooser-problem"), error.message);
  } finally {
    sending = false;
  }
}

function beginPatient() {
  const place = chosenPlace();
  if (!place.side || !place.clock_position) return problem("exam.missing_place");
  const who = { kind: "patient", patient_ref: typed("patient_ref"), operator: typed("operator") };
  if (step) return begin(() => makeOrderedExam({ step: step.id, operator: typed("operator"), ...place }));
  return begin(() => makeExam({ ...who, order_number: typed("order_number") || null, ...place }));
}

function beginPhantom() {
  if (!typed("operator")) return problem("exam.missing_operator");
  remember("operator", typed("operator"));
  step = null;
  return begin(() => makeExam({ kind: "phantom", operator: typed("operator") }));
}

fields.patient_ref.addEventListener("input", typedByHand);
fields.order_number.addEventListener("input", typedByHand);
byId("begin-exam").addEventListener("click", beginPatient);
byId("begin-phantom").addEventListener("click", beginPhantom);
byId("free-press").addEventListener("click", () => page("free"));
byId("free-yes").addEventListener("click", () => { openFree(); close(); });
for (const one of dialog.querySelectorAll(".to-who")) one.addEventListener("click", () => page("who"));
byId("chooser-close").addEventListener("click", close);
byId("who-form").addEventListener("submit", (event) => { event.preventDefault(); toMap(); });
