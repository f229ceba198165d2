// Keep a measurement under another exam: which one, and whose and of which place that is, is asked before it is done.

import { byId, element, setText } from "../base/dom.js";
import { fetchExams } from "../base/probe.js";
import { say } from "../base/words.js";
import { placeWords, whoWords } from "./current.js";
import { examRow } from "./row.js";

const RECENT = 12;
const dialog = byId("move");
let asked = null; // {measurement, exam, act}
let listed = 0;

function page(name) {
  dialog.dataset.page = name;
  if (!dialog.open) dialog.showModal();
}

/** Ask whether a measurement is of an exam; `act` is called with both after yes. */
export function askToMove(measurement, exam, act) {
  asked = { measurement, exam, act };
  const patient = whoWords(exam);
  setText(byId("move-sure"), say("move.sure", { n: measurement.seq, patient }));
  setText(byId("move-where"), placeWords(exam));
  setText(byId("move-yes"), say("move.yes", { patient }));
  page("sure");
  byId("move-no").focus(); // Enter by accident adds to nobody
}

/** Ask to which of the newest exams a measurement is to be moved, and then whether it is of that one. */
export async function chooseMove(measurement, act) {
  setText(byId("move-which"), say("move.which", { n: measurement.seq }));
  byId("move-exams").replaceChildren();
  page("which");
  const mine = (listed += 1);
  const found = await fetchExams({ limit: RECENT }).catch((error) => error);
  if (mine !== listed) return; // another measurement is to be moved meanwhile
  const others = Array.isArray(found) ? found.filter(({ id }) => id !== measurement.exam_id) : [];
  const none = element("p", "hint", found.message ?? say("exam.recent_none"));
  byId("move-exams").replaceChildren(...(others.length ? others.map((one) => examRow(one, () => askToMove(measurement, one, act))) : [none]));
}

for (const name of ["move-no", "move-back"]) byId(name).addEventListener("click", () => dialog.close());
byId("move-yes").addEventListener("click", () => {
  dialog.close();
  asked.act(asked.measurement, asked.exam);
});
