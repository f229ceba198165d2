// How far the measurements of one place agree: mean and scatter of each unknown over those that count.

import { byId, setText } from "../base/dom.js";
import { figure, say } from "../base/words.js";
import { UNKNOWNS, isDetermined } from "./quantities.js";

const mean = (numbers) => numbers.reduce((sum, one) => sum + one, 0) / numbers.length;

/** Standard deviation of a sample of two or more. */
function spread(numbers) {
  const middle = mean(numbers);
  return Math.sqrt(numbers.reduce((sum, one) => sum + (one - middle) ** 2, 0) / (numbers.length - 1));
}

function words({ name, key, unit }, measurements) {
  const values = measurements.filter(({ estimate }) => isDetermined(estimate, key)).map(({ estimate }) => estimate[key].value);
  if (values.length < 2) return "";
  const scatter = spread(values);
  const decimals = scatter >= 9.5 ? 0 : scatter >= 0.095 ? 1 : 2;
  const said = { name: say(name), mean: figure(mean(values), decimals), spread: figure(scatter, decimals), unit };
  return say("repeats.of", said);
}

/** Say how far the measurements of an exam agree; void ones do not count. */
export function showRepeats(measurements) {
  const counted = measurements.filter(({ voided }) => !voided);
  const told = UNKNOWNS.map((unknown) => words(unknown, counted)).filter(Boolean);
  const many = counted.length > 1 ? [say("repeats", { n: counted.length }), ...told].join(" · ") : say("repeats.one");
  setText(byId("repeats"), counted.length ? many : "");
}
