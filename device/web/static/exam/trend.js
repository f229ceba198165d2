// Size and depth of one lesion over time, of a patient's exams of its place: a point and its 90 % interval for each
// measurement that counts and is of one mode and model, the newest with two of them: these differ by more than presses do.

import { byId, drawn, element } from "../base/dom.js";
import { day, figure, say } from "../base/words.js";
import { modeName } from "../press/modes.js";
import { UNKNOWNS, hasOpenEnd, isDetermined, methodOf } from "../result/quantities.js";
import { placeWords, whoWords } from "./current.js";

const [WIDTH, HEIGHT, LEFT, BELOW] = [360, 130, 36, 24];
const [TOP, BOTTOM] = [6, HEIGHT - BELOW];

function axis(svg, most, first, last) {
  svg.append(
    drawn("path", { class: "trend-axis", d: `M${LEFT} 8V${BOTTOM}H${WIDTH - 8}` }),
    drawn("text", { x: LEFT - 6, y: 16, class: "trend-end" }, figure(most, 0)),
    drawn("text", { x: LEFT - 6, y: BOTTOM, class: "trend-end" }, "0"),
    drawn("text", { x: LEFT, y: HEIGHT - 6, class: "trend-day" }, day(first)),
  );
  if (day(last) !== day(first)) svg.append(drawn("text", { x: WIDTH - 8, y: HEIGHT - 6, class: "trend-end" }, day(last)));
}

/** An interval at x, from y `low` to y `high`; an open end is an arrow at the chart's edge, for the truth may lie beyond. */
function bar(x, low, high, { low_is_open: lowOpen, high_is_open: highOpen }) {
  const arrow = (edge, back) => drawn("path", { class: "trend-open", d: `M${x - 7} ${edge + back}L${x} ${edge}L${x + 7} ${edge + back}` });
  const interval = drawn("path", { class: "trend-interval", d: `M${x} ${lowOpen ? BOTTOM : low}V${highOpen ? TOP : high}` });
  return [interval, ...(highOpen ? [arrow(TOP, 8)] : []), ...(lowOpen ? [arrow(BOTTOM, -8)] : [])];
}

function chart({ name, key, unit }, measurements, place) {
  const told = measurements.filter(({ estimate }) => isDetermined(estimate, key));
  if (told.length < 2) return null;
  const title = say("history.trend", { name: say(name), unit, place });
  const svg = drawn("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": title });
  const most = Math.max(...told.map(({ estimate }) => estimate[key].high));
  const times = told.map(({ taken_at: taken }) => Date.parse(taken));
  const isRising = times.every((one, index) => index === 0 || one > times[index - 1]); // a clock may have been put back
  const along = isRising ? times.map((one) => (one - times[0]) / (times.at(-1) - times[0])) : times.map((_, index) => index / (times.length - 1));
  const at = (index) => LEFT + 20 + along[index] * (WIDTH - LEFT - 48);
  const up = (value) => BOTTOM - (Math.max(value, 0) / most) * (BOTTOM - 12);
  axis(svg, most, told[0].taken_at, told.at(-1).taken_at);
  told.forEach(({ estimate: { [key]: quantity } }, index) => {
    svg.append(...bar(at(index), up(quantity.low), up(quantity.high), quantity));
    svg.append(drawn("circle", { class: "trend-value", cx: at(index), cy: up(quantity.value), r: 4 }));
  });
  const isOpen = told.some(({ estimate }) => hasOpenEnd(estimate[key]));
  const figureNode = element("figure", "trend");
  figureNode.append(element("figcaption", "", isOpen ? `${title}. ${say("history.trend_open")}` : title), svg);
  return figureNode;
}

/** Show the trend of an exam's place, from its measurements, newest first; void ones do not count. */
export function showTrend(measurements, exam) {
  const valid = measurements.filter(({ voided }) => !voided);
  const place = valid.length ? placeWords({ ...exam, nipple_distance_mm: null }) || whoWords(exam) : "";
  const { charts, counted } = ofOneMethod(valid, place);
  const others = valid.length - counted.length;
  const left = others && charts.length ? [element("p", "hint", say("history.trend_mode", { mode: modeName(counted[0].mode), n: others }))] : [];
  byId("trends").replaceChildren(...left, ...charts);
  byId("trends").hidden = charts.length === 0;
}

/** The charts of the newest mode and model that has any, and the measurements that they are of; none where none has. */
function ofOneMethod(valid, place) {
  for (const method of new Set(valid.map(methodOf))) {
    const counted = valid.filter((one) => methodOf(one) === method).reverse();
    const charts = UNKNOWNS.slice(0, 2).map((unknown) => chart(unknown, counted, place)).filter(Boolean);
    if (charts.length) return { charts, counted };
  }
  return { charts: [], counted: [] };
}
