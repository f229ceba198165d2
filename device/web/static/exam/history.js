// What was measured: of this exam, of this patient or of all, each with its picture. Two that are marked stand side by
// side; a patient's exams make a trend.

import { button, byId, element, setText } from "../base/dom.js";
import { fetchExam, fetchExams, fetchMeasurements, fetchMeasurementsOf, reportUrl, tableUrl } from "../base/probe.js";
import { fileLink } from "../base/take_away.js";
import { moment, say } from "../base/words.js";
import { modeName } from "../press/modes.js";
import { UNKNOWNS, shortWords } from "../result/quantities.js";
import { showArchive } from "./archive.js";
import { showComparison } from "./comparison.js";
import { areOfOnePatient, areOfOnePlace, openExam, placeWords, whoWords } from "./current.js";
import { thumbnail } from "./row.js";
import { showTrend } from "./trend.js";

const PAGE = 30;
const MOST = 200; // of one answer
const dialog = byId("history");
const list = byId("history-list");
let scope = "all";
let onOpen = () => {};
let marked = [];
let exams = new Map();
let asked = 0;

/** The exam of a measurement, among those that are known or from the probe. */
async function examOf({ exam_id: id }, known) {
  if (!id) return null;
  if (!known.has(id)) known.set(id, await fetchExam(id));
  return known.get(id);
}

const ownerWords = (exam) => (exam ? `${whoWords(exam)} ${placeWords(exam)}` : say("history.free"));

const compareMarked = () => showComparison(marked, ({ exam_id: id }) => exams.get(id) ?? null);

/** Mark a measurement for the comparison; the third one takes the place of the first. */
function mark(measurement, isMarked) {
  marked = marked.filter(({ id }) => id !== measurement.id);
  if (isMarked) marked = [...marked, measurement].slice(-2);
  for (const box of list.querySelectorAll("input")) box.checked = marked.some(({ id }) => id === box.value);
  compareMarked();
  byId("comparison").scrollIntoView({ block: "start" }); // the marks may be far below
}

function marker(measurement) {
  const label = element("label", "marker");
  const box = element("input", "");
  Object.assign(box, { type: "checkbox", value: measurement.id });
  box.setAttribute("aria-label", `${say("history.compare")} ${measurement.seq}`);
  box.addEventListener("change", () => mark(measurement, box.checked));
  label.append(box);
  return label;
}

function row(measurement, exam) {
  const { seq, taken_at: at, mode, estimate, voided, truth } = measurement;
  const item = element("li", "kept");
  item.dataset.voided = Boolean(voided);
  item.dataset.id = measurement.id;
  const show = button("kept-open", "", () => { dialog.close(); onOpen(measurement.id); });
  const words = element("span", "kept-words");
  const signs = [voided && say("history.void"), estimate.simulated && say("simulated"), truth && !estimate.simulated && say("phantom")];
  words.append(
    element("strong", "", `${seq} · ${ownerWords(exam)}`),
    element("span", "", `${moment(at)}, ${modeName(mode)} ${signs.filter(Boolean).join(", ")}`),
    element("span", "", UNKNOWNS.map((one) => `${say(one.name)} ${shortWords(estimate, one)}`).join(" · ")),
  );
  show.append(thumbnail(measurement), words);
  item.append(show, marker(measurement));
  return item;
}

/** What can be taken away: the report and the table of the exam that is open, or the table of all. */
function showExports() {
  const exam = scope === "all" ? null : openExam();
  const report = exam ? [fileLink(say("history.pdf"), reportUrl(exam.id))] : [];
  byId("exports").replaceChildren(...report, fileLink(say("history.csv"), tableUrl(exam?.id)));
}

/** The exams that a scope is of, or null for all measurements; and how many of the patient's number may be another's. */
async function examsInScope() {
  const exam = openExam();
  if (!exam || scope === "all") return { inScope: null, others: 0 };
  if (scope === "exam" || exam.kind === "phantom") return { inScope: [exam], others: 0 };
  const ofNumber = { patientRef: exam.patient_ref, limit: MOST };
  const [inScope, newest] = await Promise.all([
    fetchExams({ ...ofNumber, patientIssuer: exam.patient_issuer ?? "" }),
    fetchExams(ofNumber), // those of another issuer may be so many that they would leave none of this one
  ]);
  return { inScope, others: newest.filter((one) => !areOfOnePatient(one, exam)).length };
}

/** Whether a measurement is of the place of the open exam: two lesions of one patient have a trend each. */
const isOfThisPlace = ({ exam_id: id }) => areOfOnePlace(exams.get(id), openExam());

async function page(beforeSeq, limit, known) {
  const { inScope, others } = await examsInScope();
  if (!inScope) return { measurements: await fetchMeasurements({ beforeSeq, limit }), others };
  const found = await Promise.all(inScope.map((exam) => fetchMeasurementsOf(exam.id)));
  for (const exam of inScope) known.set(exam.id, exam);
  return { measurements: found.flat().sort((a, b) => b.seq - a.seq), others };
}

async function show(beforeSeq = null, limit = PAGE, known = new Map(exams)) {
  const mine = (asked += 1);
  const { measurements, others } = await page(beforeSeq, limit, known);
  const rows = await Promise.all(measurements.map(async (one) => row(one, await examOf(one, known))));
  if (mine !== asked) return; // something else is asked for meanwhile
  exams = new Map([...exams, ...known]);
  marked = marked.map((one) => measurements.find(({ id }) => id === one.id) ?? one);
  compareMarked();
  showExports();
  if (beforeSeq) list.append(...rows);
  else list.replaceChildren(...rows);
  byId("history-none").hidden = list.childElementCount > 0;
  byId("history-others").hidden = others === 0;
  setText(byId("history-others"), others ? say("history.others", { number: openExam().patient_ref, n: others }) : "");
  const more = byId("history-more");
  more.hidden = scope !== "all" || measurements.length < limit;
  more.dataset.before = measurements.at(-1)?.seq ?? "";
  showTrend(scope === "patient" ? measurements.filter(isOfThisPlace) : [], openExam());
  showArchive(scope === "exam", measurements);
}

/** Take away what was listed until the probe has answered: it may be of another exam. */
function clear() {
  list.replaceChildren();
  byId("exports").replaceChildren();
  for (const one of ["none", "others", "more"]) byId(`history-${one}`).hidden = true;
  showTrend([], null);
  showArchive(false, []);
}

function choose(next) {
  scope = next;
  list.parentElement.scrollTop = 0;
  marked = [];
  showComparison(marked);
  for (const one of ["exam", "patient", "all"]) byId(`history-${one}`).setAttribute("aria-pressed", one === next);
  clear();
  const [showing, mine] = [show(), asked];
  showing.catch((error) => { if (mine === asked) list.replaceChildren(element("li", "problem", error.message)); });
}

for (const one of ["exam", "patient", "all"]) byId(`history-${one}`).addEventListener("click", () => choose(one));
byId("history-more").addEventListener("click", ({ currentTarget }) => show(Number(currentTarget.dataset.before)).catch(() => {}));
byId("history-close").addEventListener("click", () => dialog.close());

/** Show it anew while it is open, for another screen has measured or changed something; marks and focus stay. */
export async function refreshHistory() {
  if (!dialog.open) return;
  const focused = document.activeElement?.closest(".kept");
  const nth = focused && [...focused.querySelectorAll("button, input")].indexOf(document.activeElement);
  const many = Math.min(Math.max(PAGE, list.childElementCount), MOST);
  await show(null, many, new Map()).catch(() => {}); // the next change asks again
  for (const box of list.querySelectorAll("input")) box.checked = marked.some(({ id }) => id === box.value);
  if (focused && !focused.isConnected) list.querySelector(`[data-id="${CSS.escape(focused.dataset.id)}"]`)?.querySelectorAll("button, input")[nth].focus();
}

/** Open the history of the exam that is open, else of all; what is chosen in it is handed to `act` by its id. */
export function openHistory(act) {
  onOpen = act;
  const exam = openExam();
  exams = new Map();
  byId("history-exam").hidden = byId("history-patient").hidden = !exam;
  choose(exam ? "exam" : "all");
  dialog.showModal();
}
