// Two measurements side by side: whose they are, pictures, values with their intervals, and between which ends the
// difference lies, where both are of one place, mode and model, count, and determine it.

import { byId, element, setText } from "../base/dom.js";
import { imageUrl } from "../base/probe.js";
import { figure, moment, say } from "../base/words.js";
import { modeName } from "../press/modes.js";
import { UNKNOWNS, isDetermined, modelOf, shortWords, shownEnds } from "../result/quantities.js";
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

const signed = (x, decimals) => `${x > 0 ? "+" : ""}${figure(x, decimals)}`;

/** Between which ends two values lie apart. Intervals are skewed, so each end has the arms that lead to it: those of
 * independent measurements add up by their squares. */
function endsOfDifference(one, other) {
  const apart = other.value - one.value;
  return {
    apart,
    low: apart - Math.hypot(other.value - other.low, one.high - one.value),
    high: apart + Math.hypot(other.high - other.value, one.value - one.low),
    lowOpen: Boolean(other.low_is_open || one.high_is_open),
    highOpen: Boolean(other.high_is_open || one.low_is_open),
  };
}

/** The difference in words: none where the end that is nearer to no difference is beyond it, or open. */
function difference([one, other], { key, unit }) {
  if (![one, other].every(({ estimate }) => isDetermined(estimate, key))) return "–";
  const ends = endsOfDifference(one.estimate[key], other.estimate[key]);
  if (ends.apart >= 0 ? ends.lowOpen : ends.highOpen) return say("history.apart_open");
  if (ends.apart >= 0 ? ends.low <= 0 : ends.high >= 0) return say("history.no_difference");
  const [low, high] = shownEnds(ends, signed);
  if (!/[1-9]/.test(ends.apart >= 0 ? low : high)) return say("history.no_difference"); // rounded outwards it reaches 0
  if (ends.highOpen) return say("result.or_more", { value: low, unit });
  return ends.lowOpen ? say("result.or_less", { value: high, unit }) : say("result.range", { low, high, unit });
}

/** Whose a measurement is, how it was taken, and whether it counts. */
function heading({ seq, taken_at: at, mode, voided }, exam) {
  const words = element("span", "");
  const whose = exam ? `${whoWords(exam)} ${placeWords(exam)}` : say("history.free");
  words.append(element("strong", "", `${seq} · ${whose}`), element("br", ""), `${moment(at)}, ${modeName(mode)}`);
  if (voided) words.append(element("br", ""), element("strong", "problem", say("history.void")));
  return words;
}

/** Why two measurements have no difference, as a key of words; "" where they have: both count, and are of one lesion (of
 * one phantom exam, or of one place of a patient), one mode and one model. */
function whyNotComparable([one, other], exams) {
  if (one.voided || other.voided) return "history.apart_void";
  const isOfOneExam = exams[0] && exams[0].id === exams[1]?.id;
  const isOfOneLesion = isOfOneExam || (exams[0]?.kind === "patient" && exams[1] && areOfOnePlace(...exams));
  if (!isOfOneLesion) return "history.apart_place";
  if (one.mode !== other.mode) return "history.apart_mode";
  return modelOf(one.estimate) === modelOf(other.estimate) ? "" : "history.apart_model";
}

/** Show two measurements, the older one first, `examOf` each from what it is kept under; fewer than two are none. */
export function showComparison(measurements, examOf = () => null) {
  const box = byId("comparison");
  byId("compare-hint").hidden = measurements.length === 2;
  byId("compare-why").hidden = true;
  box.hidden = measurements.length < 2;
  if (measurements.length < 2) return;
  const pair = [...measurements].sort((a, b) => a.seq - b.seq);
  const exams = pair.map(examOf);
  const why = whyNotComparable(pair, exams);
  const apart = why ? () => "–" : (one) => difference(pair, one);
  const rows = UNKNOWNS.map((one) => line(say(one.name), [...pair.map(({ estimate }) => shortWords(estimate, one)), apart(one)]));
  box.replaceChildren(
    line("", [...pair.map((one, index) => heading(one, exams[index])), say("history.difference")]),
    line("", [...pair.map(picture), ""]),
    ...rows,
  );
  byId("compare-why").hidden = !why;
  setText(byId("compare-why"), why && say(why));
}
