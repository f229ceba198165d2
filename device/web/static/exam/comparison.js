// Two measurements side by side: whose they are, pictures, values with their intervals, and between which ends the
// difference lies, where both are of one place, count, and determine it.

import { byId, element } from "../base/dom.js";
import { imageUrl } from "../base/probe.js";
import { figure, moment, say } from "../base/words.js";
import { modeName } from "../press/modes.js";
import { UNKNOWNS, isDetermined, shortWords } from "../result/quantities.js";
import { areOfOnePlace, placeWords, whoWords } from "./current.js";

function picture({ id, seq }) {
  const image = element("img", "thumbnail thumbnail-large");
  Object.assign(image, { src: imageUrl(id), alt: say("picture", { n: seq }) });
  return image;
}

function line(name, cells) {
  const row = element("tr", "");
  const head = element("th", "", name);
  head.scope = "row";
  row.append(head, ...cells.map((cell) => {
    const data = element("td", "");
    data.append(cell);
    return data;
  }));
  return row;
}

const signed = (x) => `${x > 0 ? "+" : ""}${figure(x, 1)}`;

/** Between which ends the difference lies: half widths of 90 % of both, which are independent, add up by their squares. */
function difference([one, other], { key, unit }) {
  const quantities = [one, other].map(({ estimate }) => estimate[key]);
  const isTold = [one, other].every(({ estimate }) => isDetermined(estimate, key)) && !quantities.some((of) => of.low_is_open || of.high_is_open);
  if (!isTold) return "–";
  const apart = quantities[1].value - quantities[0].value;
  const half = Math.hypot(...quantities.map(({ low, high }) => (high - low) / 2));
  if (Math.abs(apart) <= half) return say("history.no_difference");
  return say("result.range", { low: signed(apart - half), high: signed(apart + half), unit });
}

/** Whose a measurement is, how it was taken, and whether it counts. */
function heading({ seq, taken_at: at, mode, voided }, exam) {
  const words = element("span", "");
  const whose = exam ? `${whoWords(exam)} ${placeWords(exam)}` : say("history.free");
  words.append(element("strong", "", `${seq} · ${whose}`), element("br", ""), `${moment(at)}, ${modeName(mode)}`);
  if (voided) words.append(element("br", ""), element("strong", "problem", say("history.void")));
  return words;
}

/** Whether two measurements count and are of one lesion: of one phantom exam, or of one place of a patient. */
function areComparable([one, other], exams) {
  if (!exams[0] || !exams[1] || one.voided || other.voided) return false;
  return exams[0].id === exams[1].id || (exams[0].kind === "patient" && areOfOnePlace(...exams));
}

/** Show two measurements, the older one first, `examOf` each from what it is kept under; fewer than two are none. */
export function showComparison(measurements, examOf = () => null) {
  const box = byId("comparison");
  byId("compare-hint").hidden = measurements.length === 2;
  box.hidden = measurements.length < 2;
  if (measurements.length < 2) return;
  const pair = [...measurements].sort((a, b) => a.seq - b.seq);
  const exams = pair.map(examOf);
  const apart = areComparable(pair, exams) ? (one) => difference(pair, one) : () => "–";
  const rows = UNKNOWNS.map((one) => line(say(one.name), [...pair.map(({ estimate }) => shortWords(estimate, one)), apart(one)]));
  box.replaceChildren(
    line("", [...pair.map((one, index) => heading(one, exams[index])), say("history.difference")]),
    line("", [...pair.map(picture), ""]),
    ...rows,
  );
  box.scrollIntoView({ block: "start" }); // the marks may be far below
}
