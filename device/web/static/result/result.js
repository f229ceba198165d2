// One measurement as three tiles, its tactile image and what it says in words. A number that the data do not determine
// gets no headline: the tile says so and shows only the interval.

import { byId, element, setQuantity, setText } from "../base/dom.js";
import { figure, keptReason, moment, say, understand } from "../base/words.js";
import { meaningOf } from "../press/faults.js";
import { modeName, surerWords } from "../press/modes.js";
import { showPicture } from "./picture.js";
import { UNKNOWNS, intervalWords, isBounded, isDetermined, valueFigure } from "./quantities.js";

const MOST_WARNINGS = 2; // that have room; "Details" has all
const NO_INCLUSION = "No inclusion can be told";

/** The smallest round number that is not below x: the right end of a tile's strip. */
function roundUp(x) {
  const decade = 10 ** Math.floor(Math.log10(x));
  return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].map((factor) => factor * decade).find((end) => end >= x * 0.999);
}

function placed(className, from, width, end) {
  const node = element("span", className);
  node.style.setProperty("--from", from / end);
  node.style.setProperty("--width", width / end);
  return node;
}

/** The interval, the value and the truth on one axis from zero, so that a wide interval looks wide. */
function drawStrip(strip, quantity, truth, determined) {
  const end = roundUp(Math.max(quantity.high, truth ?? 0));
  const low = quantity.low_is_open ? 0 : Math.max(quantity.low, 0);
  const high = quantity.high_is_open ? end : quantity.high;
  const axis = element("span", "strip-axis");
  axis.append(placed("strip-interval", low, high - low, end));
  if (determined) axis.append(placed("strip-value", quantity.value, 0, end));
  if (truth !== null) axis.append(placed("strip-truth", truth, 0, end));
  strip.replaceChildren(element("span", "", "0"), axis, element("span", "", figure(end, 0)));
}

/** What a phantom is known to hold; without an inclusion it has neither depth nor modulus. */
function truthWords(truth, { key, unit }) {
  if (!truth) return "";
  if (truth.size_mm === 0) return key === "size_mm" ? say("result.no_inclusion") : "–";
  return `${figure(truth[key], 1)} ${unit}`;
}

function showTile(unknown, { estimate, truth }) {
  const { name, key, unit } = unknown;
  const quantity = estimate[key];
  const determined = isDetermined(estimate, key);
  const hasInterval = isBounded(quantity);
  const tile = byId(`${name}-tile`);
  tile.dataset.determined = determined;
  if (determined) setQuantity(byId(`${name}-value`), valueFigure(quantity), unit);
  else setText(byId(`${name}-value`), say("result.not_determined"));
  setText(byId(`${name}-interval`), hasInterval ? intervalWords(quantity, unit) : say("result.none"));
  setText(byId(`truth-${name}`), truthWords(truth, unknown));
  setText(tile.querySelector(".truth-label"), say(estimate.simulated ? "result.simulated_truth" : "result.phantom_truth"));
  tile.querySelector(".truth").hidden = !truth;
  const strip = tile.querySelector(".strip");
  const known = truth && truth.size_mm > 0 ? truth[key] : null;
  if (hasInterval) drawStrip(strip, quantity, known, determined);
  else strip.replaceChildren();
}

/** Fill the result view from a measurement of GET /api/v1/measurements/{id}, or an answer that is being kept. */
export function showMeasurement(measurement) {
  for (const unknown of UNKNOWNS) showTile(unknown, measurement);
  byId("panel").dataset.numbers = UNKNOWNS.some(({ key }) => isBounded(measurement.estimate[key])) ? "some" : "none";
  byId("result").dataset.voided = Boolean(measurement.voided);
  showPicture(measurement);
  const mode = modeName(measurement.mode);
  const title = measurement.seq ? say("result.title", { n: measurement.seq, mode }) : say("result.being_kept", { mode });
  setText(byId("image-title"), title);
  setText(byId("image-caption"), moment(measurement.taken_at));
}

function warningNodes(warning, index) {
  return [index ? " · " : " ", warning.code, element("span", "kept-title", ` ${meaningOf(warning)}`)];
}

/** Say what was warned of at a measurement from the history; what stands among the faults is of now. */
export function showKeptWarnings(warnings) {
  const told = warnings.slice(0, MOST_WARNINGS);
  const more = warnings.length > told.length ? [` ${say("faults.more", { n: warnings.length - told.length })}`] : [];
  byId("kept-warnings").replaceChildren(...(told.length ? [say("result.warned"), ...told.flatMap(warningNodes), ...more] : []));
}

function headline({ status, reason, ...quantities }) {
  if (reason.startsWith(NO_INCLUSION)) return "result.nothing";
  const known = UNKNOWNS.filter(({ key }) => quantities[key].identifiable === true).length;
  // Measurements of before say not_identifiable also where only a part is.
  const inPart = known > 0 && known < UNKNOWNS.length && (status === "ok" || status === "not_identifiable");
  return `result.${inPart ? "partly_identifiable" : status}`;
}

function scanWords({ ramps, reached }) {
  const said = ramps > 1 ? [say("result.presses", { n: ramps })] : [];
  if (reached === true) said.push(say("result.reached"));
  if (reached === false) said.push(say("result.not_reached"));
  return said;
}

/** What a measurement says: its headline, the reason with what would make it surer, and whether it is good as it is. */
export function describeMeasurement(measurement) {
  const { estimate, voided, reached } = measurement;
  if (voided) {
    const why = { by: voided.by, at: moment(voided.at), reason: keptReason(voided.reason) };
    return { word: say("result.void"), reason: say("result.void_why", why), tone: "caution" };
  }
  const key = headline(estimate);
  const understood = estimate.reason ? understand(estimate.reason) : { do: "", why: say("result.all") };
  const [todo, why] = [understood?.do, understood?.why ?? say("reason.other")];
  const surer = ["result.ok", "result.partly_identifiable"].includes(key) ? surerWords(measurement) : "";
  const reason = [why, todo && `${todo}.`, ...scanWords(measurement), surer].filter(Boolean).join(" ");
  const isGood = ["result.ok", "result.partly_identifiable"].includes(key) && reached !== false;
  return { word: say(key), reason, tone: isGood ? "good" : "caution" };
}
