// How far the measurements of one place agree: from which value to which each unknown goes over those that count, and were
// made in the mode and by the model of the newest: a quick press and a scan differ by what each can tell. An interval with
// an open end has a value that is no measured one, so an unknown with such a press has no range:
// device/measurement/repeats.py has its rule.

import { byId, setText } from "../base/dom.js";
import { figure, say } from "../base/words.js";
import { modeName } from "../press/modes.js";
import { UNKNOWNS, decimalsFor, hasOpenEnd, isDetermined, methodOf } from "./quantities.js";

function words({ name, key, unit }, measurements) {
  const told = measurements.filter(({ estimate }) => isDetermined(estimate, key)).map(({ estimate }) => estimate[key]);
  if (told.length < 2) return "";
  if (told.some(hasOpenEnd)) return say("repeats.open", { name: say(name) });
  const values = told.map(({ value }) => value);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  const decimals = Math.max(...told.map(decimalsFor));
  return say("repeats.of", { name: say(name), low: figure(low, decimals), high: figure(high, decimals), unit });
}

/** Say how far the measurements of an exam agree, the newest first; void ones do not count. */
export function showRepeats(measurements) {
  const valid = measurements.filter(({ voided }) => !voided);
  const counted = valid.filter((one) => methodOf(one) === methodOf(valid[0]));
  const told = UNKNOWNS.map((unknown) => words(unknown, counted)).filter(Boolean);
  const said = { n: counted.length, mode: counted.length ? modeName(counted[0].mode) : "" };
  const many = counted.length > 1 ? [say("repeats", said), ...told].join(" · ") : say("repeats.one");
  setText(byId("repeats"), counted.length ? many : "");
}
