// How a measurement was pressed: a point for the force of each image over time, beside the lesion and on it.

import { drawn } from "../base/dom.js";
import { figure, say } from "../base/words.js";

const [WIDTH, HEIGHT, LEFT, BELOW] = [480, 150, 44, 26];
const PLACES = { reference: "step.reference", press: "step.lesion" };

function axis(svg, most, last) {
  const bottom = HEIGHT - BELOW;
  svg.append(
    drawn("path", { class: "trend-axis", d: `M${LEFT} 8V${bottom}H${WIDTH - 8}` }),
    drawn("text", { x: LEFT - 6, y: 18, class: "trend-end" }, `${figure(most, 1)} N`),
    drawn("text", { x: LEFT - 6, y: bottom, class: "trend-end" }, "0"),
    drawn("text", { x: WIDTH - 8, y: HEIGHT - 6, class: "trend-end" }, `${figure(last, 1)} s`),
  );
}

/** Draw the frames of GET measurements/ID/forces; null where none was taken in a press. */
export function forceCurve(frames) {
  const taken = frames.filter(({ role }) => role in PLACES);
  if (!taken.length) return null;
  const first = Math.min(...taken.map(({ t_s: t }) => t));
  const last = Math.max(...taken.map(({ t_s: t }) => t)) - first || 1;
  const most = Math.max(...taken.map(({ force_n: force }) => force), 0.1);
  const svg = drawn("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": say("details.forces_of", { n: taken.length }) });
  axis(svg, most, last);
  const bottom = HEIGHT - BELOW;
  for (const { role, t_s: t, force_n: force } of taken) {
    const cx = LEFT + 8 + ((t - first) / last) * (WIDTH - LEFT - 24);
    const cy = bottom - (Math.max(force, 0) / most) * (bottom - 14);
    svg.append(drawn("circle", { class: `force-point force-${role}`, cx, cy, r: 4 }));
  }
  Object.keys(PLACES).forEach((role, index) => {
    const x = LEFT + 16 + index * 150;
    svg.append(drawn("circle", { class: `force-point force-${role}`, cx: x, cy: HEIGHT - 11, r: 4 }));
    svg.append(drawn("text", { x: x + 10, y: HEIGHT - 6 }, say(PLACES[role])));
  });
  return svg;
}
