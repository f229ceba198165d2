// A check of the self-test in the operator's words: its name, what it measured, and what to do. The daemon's own words
// stand one tap away.

import { meaningOf, remedyOf } from "../press/faults.js";
import { day, figure, isSaid, say, spokenNumber, understandRemedy } from "../base/words.js";

const NAMES = [
  [/^model (?<name>.+)$/, "check.model", ({ name }) => ({ name: isSaid(`mode.${name}`) ? say(`mode.${name}`) : name })],
  [/^LED (?<side>[+-][xy])$/, "check.LED", (found) => found],
  [/^date after (?<at>.+)$/, "check.date", ({ at }) => ({ day: day(at) })],
];
const LIMIT = /(at least|above|at most|below) (\S+)/g;

/** The name of a check. */
export function checkName({ check }) {
  const [pattern, key, values] = NAMES.find(([one]) => one.test(check)) ?? [];
  return pattern ? say(key, values(pattern.exec(check).groups)) : say(`check.${check}`);
}

const unitWords = (unit) => (isSaid(`unit.${unit}`) ? say(`unit.${unit}`) : unit);

/** A bound as the daemon writes it, "at least 50 MB", or "above -2 and below 2 N". */
function boundWords(bound, unit) {
  const limits = unit && bound.endsWith(` ${unit}`) ? bound.slice(0, -unit.length - 1) : bound;
  const said = limits.replace(LIMIT, (whole, word, number) => say(`bound.${word}`, { n: spokenNumber(number) }));
  return `${said.replace(" and ", ` ${say("and")} `)} ${unitWords(unit)}`.trim();
}

/** What was measured and what is needed, "" where nothing was. */
export function measuredWords({ value, unit, bound }) {
  if (value === null) return "";
  const size = Math.abs(value);
  const said = size !== 0 && (size < 0.001 || size >= 1e5) ? value.toExponential(1) : figure(value, size < 10 ? 3 : 0);
  return say("self_test.measured", { value: said, unit: unitWords(unit), bound: boundWords(bound, unit) });
}

/** What to do about a check that was not passed; of one that a fault kept from being done, with what that is. */
export function checkRemedy({ code, cause, remedy }) {
  if (code) return `${code} ${meaningOf({ code })}. ${remedyOf({ code, remedy })}`;
  return understandRemedy(remedy) ?? say("remedy.other");
}
