// Where the lesion is: side and clock position by one touch on a map as the examiner sees the patient, and the distance
// from the nipple in steps. The patient's right side is on the left.

import { button, byId, element, setText } from "../base/dom.js";
import { figure, say } from "../base/words.js";

const HOURS = 12;
const STEP_MM = 5;
const [LEAST_MM, MOST_MM] = [0, 250];
const USUAL_MM = 30;
let place = { side: null, clock_position: null, nipple_distance_mm: null };
let listener = () => {};

function hourButton(side, hour) {
  const node = button("hour", String(hour), () => choose({ side, clock_position: hour }));
  const angle = (hour / HOURS) * 2 * Math.PI;
  node.style.setProperty("--x", Math.sin(angle).toFixed(4));
  node.style.setProperty("--y", (-Math.cos(angle)).toFixed(4));
  node.setAttribute("aria-label", say("map.clock", { side: say(`side.${side}`), clock: hour }));
  node.dataset.side = side;
  node.dataset.hour = hour;
  return node;
}

function clock(side) {
  const node = element("div", "clock");
  node.dataset.side = side;
  node.setAttribute("role", "group");
  node.setAttribute("aria-label", say(`side.${side}.breast`));
  node.append(element("span", "clock-name", say(`side.${side}`)));
  for (let hour = 1; hour <= HOURS; hour += 1) node.append(hourButton(side, hour));
  return node;
}

/** Move the distance by whole steps; the first step says what is usual, one below nothing takes it back. */
function move(steps) {
  const before = place.nipple_distance_mm;
  const mm = before === null ? USUAL_MM : before + steps * STEP_MM;
  choose({ nipple_distance_mm: mm < LEAST_MM ? null : Math.min(mm, MOST_MM) });
}

function show() {
  const { side, clock_position: hour, nipple_distance_mm: mm } = place;
  for (const node of byId("body-map").querySelectorAll(".hour")) {
    const isIt = node.dataset.side === side && Number(node.dataset.hour) === hour;
    node.setAttribute("aria-pressed", isIt);
  }
  byId("body-map").dataset.side = side ?? "right";
  for (const one of ["left", "right"]) byId(`side-${one}`).setAttribute("aria-pressed", (side ?? "right") === one);
  setText(byId("distance"), mm === null ? say("map.mm_unknown") : say("map.mm", { mm: figure(mm, 0) }));
}

function choose(change) {
  place = { ...place, ...change };
  show();
  listener(place);
}

/** Begin anew with a place, of an exam or none. */
export function beginMap({ side = null, clock_position = null, nipple_distance_mm = null } = {}, onPlace = () => {}) {
  listener = onPlace;
  choose({ side, clock_position, nipple_distance_mm });
}

/** The place that is chosen, as fields of an exam. */
export const chosenPlace = () => place;

byId("clocks").append(clock("right"), clock("left"));
byId("nearer").addEventListener("click", () => move(-1));
byId("farther").addEventListener("click", () => move(1));
// On a small screen one side is shown at a time.
for (const side of ["left", "right"]) byId(`side-${side}`).addEventListener("click", () => choose({ side, clock_position: null }));
