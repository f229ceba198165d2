// The exams beside the press, where the screen is wide enough: one touch goes on with one of them, and below the one that
// is open stands what was measured in it. A smaller screen asks for none of it.

import { button, byId, element, setAttribute } from "../base/dom.js";
import { fetchExams, fetchMeasurements } from "../base/probe.js";
import { moment, say } from "../base/words.js";
import { UNKNOWNS, shortWords } from "../result/quantities.js";
import { chooseExam, goOn } from "./chooser.js";
import { onExam, openExam } from "./current.js";
import { examRow, thumbnail } from "./row.js";

const MOST_EXAMS = 20;
const MOST_MEASUREMENTS = 20;
const wide = matchMedia("(min-width: 1200px) and (min-height: 640px)"); // as styles/sizes.css has it
let onMeasurement = () => {};
let isLoading = false;
let isOld = false;

function measurementRow(measurement) {
  const { id, seq, taken_at: at, estimate, voided } = measurement;
  const node = button("kept-open", "", () => onMeasurement(id));
  const words = element("span", "kept-words");
  words.append(element("strong", "", `${seq} · ${voided ? say("history.void") : moment(at)}`));
  words.append(...UNKNOWNS.slice(0, 2).map((one) => element("span", "", `${say(one.name)} ${shortWords(estimate, one)}`)));
  node.append(thumbnail(measurement), words);
  node.dataset.voided = Boolean(voided);
  return node;
}

function examItem(exam, measurements) {
  const isOpen = exam.id === openExam()?.id;
  const item = element("li", "beside-exam");
  const row = examRow(exam, goOn);
  if (isOpen) setAttribute(row, "aria-current", "true");
  item.append(row, ...(isOpen ? measurements.map(measurementRow) : []));
  return item;
}

/** The newest exams, patients' and phantoms', and the open one in any case. */
async function examsBeside() {
  const kinds = await Promise.all(["patient", "phantom"].map((kind) => fetchExams({ kind, limit: MOST_EXAMS })));
  const newest = kinds.flat().sort((a, b) => (a.made_at < b.made_at ? 1 : -1)).slice(0, MOST_EXAMS);
  const exam = openExam();
  return exam && !newest.some(({ id }) => id === exam.id) ? [exam, ...newest] : newest;
}

async function load() {
  const exam = openExam();
  const asked = exam ? fetchMeasurements({ examId: exam.id, limit: MOST_MEASUREMENTS }) : [];
  const [exams, measurements] = await Promise.all([examsBeside(), asked]);
  if (exam?.id !== openExam()?.id) return; // another is open meanwhile, and asked for next
  const none = element("li", "hint", say("exam.recent_none"));
  byId("beside-list").replaceChildren(...(exams.length ? exams.map((one) => examItem(one, measurements)) : [none]));
}

/** Ask the probe for the exams anew, once at a time; what changes meanwhile is asked for after that. */
export async function showBeside() {
  isOld = true;
  if (isLoading || !wide.matches) return;
  isLoading = true;
  while (isOld) {
    isOld = false;
    await load().catch(() => {}); // the page says elsewhere that nobody answers, and asks when somebody does
  }
  isLoading = false;
}

/** Show the exams where there is room; a measurement that is chosen is handed to `act` by its id. */
export function useBeside(act) {
  onMeasurement = act;
  onExam(showBeside);
  wide.addEventListener("change", showBeside);
  byId("beside-new").addEventListener("click", () => chooseExam());
}
