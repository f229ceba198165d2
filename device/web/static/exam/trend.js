// Size and depth of one lesion over time, of a patient's exams of its place: a point and its 90 % interval for each
// measurement that counts.

import { byId, drawn, element } from "../base/dom.js";
import { day, figure, say } from "../base/words.js";
import { UNKNOWNS, isDetermined } from "../result/quantities.js";
import { placeWords, whoWords } from "./current.js";

const [WIDTH, HEIGHT, LEFT, BELOW] = [360, 130, 36, 24];

function axis(svg, most, first, last) {
  const bottom = HEIGHT - BELOW;
  svg.append(
    drawn("path", { class: "trend-axis", d: `M${LEFT} 8V${bottom}H${WIDTH - 8}` }),
    drawn("text", { x: LEFT - 6, y: 16, class: "trend-end" }, figure(most, 0)),
    drawn("text", { x: LEFT - 6, y: bottom, class: "trend-end" }, "0"),
    drawn("text", { x: LEFT, y: HEIGHT - 6, class: "trend-day" }, day(first)),
  );
  if (day(last) !== day(first)) svg.append(drawn("text", { x: WIDTH - 8, y: HEIGHT - 6, class: "trend-end" }, day(last)));
}

function chart({ name, key, unit }, measurements, place) {
  const told = measurements.filter(({ estimate }) => isDetermined(estimate, key));
  if (told.length < 2) return null;
  const title = say("history.trend", { name: say(name), unit, place });
  const svg = drawn("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": title });
  const most = Math.max(...told.map(({ estimate }) => estimate[key].high));
  const bottom = HEIGHT - BELOW;
  const times = told.map(({ taken_at: taken }) => Date.parse(taken));
  const isRising = times.every((one, index) => index === 0 || one > times[index - 1]); // a clock may have been put back
  const along = isRising ? times.map((one) => (one - times[0]) / (times.at(-1) - times[0])) : times.map((_, index) => index / (times.length - 1));
  const at = (index) => LEFT + 20 + along[index] * (WIDTH - LEFT - 48);
  const up = (value) => bottom - (Math.max(value, 0) / most) * (bottom - 12);
  axis(svg, most, told[0].taken_at, told.at(-1).taken_at);
  told.forEach(({ estimate: { [key]: quantity } }, index) => {
    svg.append(drawn("path", { class: "trend-interval", d: `M${at(index)} ${up(quantity.low)}V${up(quantity.high)}` }));
    svg.append(drawn("circle", { class: "trend-value", cx: at(index), cy: up(quantity.value), r: 4 }));
  });
  const figureNode = element("figure", "trend");
  figureNode.append(element("figcaption", "", title), svg);
  return figureNode;
}

/** Show the trend of an exam's place, from its measurements, newest first; void ones do not count. */
export function showTrend(measurements, exam) {
  const counted = measurements.filter(({ voided }) => !voided).reverse();
  const place = counted.length ? placeWords({ ...exam, nipple_distance_mm: null }) || whoWords(exam) : "";
  const charts = UNKNOWNS.slice(0, 2).map((unknown) => chart(unknown, counted, place)).filter(Boolean);
  byId("trends").replaceChildren(...charts);
  byId("trends").hidden = charts.length === 0;
}
