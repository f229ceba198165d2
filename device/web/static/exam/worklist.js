// What the hospital has ordered: steps of its worklist, to begin an exam of one without typing patient or order. Shown where
// a worklist is set, to whoever may begin exams.

import { button, byId, element } from "../base/dom.js";
import { fetchWorklist } from "../base/probe.js";
import { dicomDay, dicomTime, say } from "../base/words.js";
import { hasWorklist } from "./archive.js";
import { patientWords } from "./current.js";

const list = byId("ordered");
let asked = 0;

/** A name of DICOM's, FAMILY^GIVEN, as a person reads it. */
export const nameWords = ({ patient_name: name, patient_ref: ref }) => name.split("^").filter(Boolean).reverse().join(" ") || ref;

function stepRow(step, act) {
  const node = button("recent", "", () => act(step));
  const born = step.patient_birth_date ? say("worklist.born", { day: dicomDay(step.patient_birth_date) }) : "";
  const what = [dicomTime(step.scheduled_at), step.description, step.order_number].filter(Boolean).join(" · ");
  node.append(element("strong", "", nameWords(step)), element("span", "", patientWords(step)));
  node.append(element("small", "", [born, what].filter(Boolean).join(" · ")));
  return node;
}

/** Show what is ordered: of a patient, else of today; the step that is chosen is handed to `act`. */
export async function showOrdered(patientRef, act) {
  byId("ordered-today").hidden = !hasWorklist();
  if (!hasWorklist()) return;
  const mine = (asked += 1);
  list.replaceChildren(element("p", "hint", say("worklist.asking")));
  const steps = await fetchWorklist(patientRef).catch((error) => error);
  if (mine !== asked) return; // somebody has asked for another patient meanwhile
  const isSilent = !Array.isArray(steps);
  const none = element("p", "hint", say(isSilent ? "worklist.silent" : "worklist.none"));
  list.replaceChildren(...(isSilent || !steps.length ? [none] : steps.map((step) => stepRow(step, act))));
}
