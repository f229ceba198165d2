// One measurement as three tiles and its tactile image. A number that the data do not determine gets no headline:
// the tile says so and shows only the interval.

import { byId, element, setQuantity, setText } from "./dom.js";
import { imageUrl } from "./probe.js";

const TILES = [
  { name: "size", key: "size_mm", unit: "mm" },
  { name: "depth", key: "depth_mm", unit: "mm" },
  { name: "modulus", key: "youngs_modulus_kpa", unit: "kPa" },
];

const STATUS_WORDS = {
  outside_range: "No numbers.",
  no_contact: "No contact.",
  saturated: "Image too bright.",
  partly_identifiable: "Measured in part.",
  not_identifiable: "Not determined.",
  rejected: "Rejected.",
};
const WITHOUT_NUMBERS = new Set(["no_contact", "saturated", "rejected"]);

/** Digits that the interval supports: whole units once it is ten units wide. */
const decimalsFor = (quantity) => (quantity.high - quantity.low >= 10 ? 0 : 1);

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

/** The interval in words. Where it ends with the trained range it is open: the truth may as well lie beyond. */
function spokenInterval({ low, high, low_is_open: lowOpen, high_is_open: highOpen }, decimals, unit) {
  if (lowOpen === highOpen) return `${low.toFixed(decimals)} – ${high.toFixed(decimals)} ${unit}`;
  return lowOpen ? `${high.toFixed(decimals)} ${unit} or less` : `${low.toFixed(decimals)} ${unit} or more`;
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
  strip.replaceChildren(element("span", "", "0"), axis, element("span", "", String(end)));
}

function showTile({ name, key, unit }, measurement) {
  const quantity = measurement.estimate[key];
  const truth = measurement.truth?.[key] ?? null;
  const decimals = decimalsFor(quantity);
  const bounded = Number.isFinite(quantity.low) && Number.isFinite(quantity.high);
  const usable = !WITHOUT_NUMBERS.has(measurement.estimate.status);
  const determined = usable && quantity.identifiable === true && Number.isFinite(quantity.value);
  const tile = byId(`${name}-tile`);
  tile.dataset.determined = determined;
  if (determined) setQuantity(byId(`${name}-value`), quantity.value.toFixed(decimals), unit);
  else setText(byId(`${name}-value`), "not determined");
  setText(byId(`${name}-interval`), usable && bounded ? spokenInterval(quantity, decimals, unit) : "none");
  setText(byId(`truth-${name}`), truth === null ? "" : `${truth.toFixed(1)} ${unit}`);
  setText(tile.querySelector(".truth-label"), measurement.estimate.simulated ? "simulated truth" : "phantom truth");
  tile.querySelector(".truth").hidden = truth === null;
  const strip = tile.querySelector(".strip");
  if (usable && bounded) drawStrip(strip, quantity, truth, determined);
  else strip.replaceChildren();
}

function showPicture({ id, seq }) {
  const image = byId("image");
  if (id) image.src = imageUrl(id);
  else image.removeAttribute("src");
  image.alt = id ? `Tactile image of measurement ${seq}` : "";
}

/** Fill the result view from a measurement of GET /api/v1/measurements/{id}, or an answer that is being kept. */
export function showMeasurement(measurement) {
  for (const tile of TILES) showTile(tile, measurement);
  const bounded = TILES.some(({ key }) => Number.isFinite(measurement.estimate[key].low));
  byId("panel").dataset.numbers = bounded ? "some" : "none";
  showPicture(measurement);
  setText(byId("image-title"), `Measurement ${measurement.seq ?? "being kept"}, ${measurement.mode}`);
  setText(byId("image-caption"), measurement.taken_at.slice(0, 16).replace("T", " ") + " UTC");
}

const REACHED_WORDS = { true: ": as sure as asked for", false: ": not as sure as asked for" };

/** What a measurement says in words, of a scan also by how many presses, and whether it is as sure as asked for. */
export function describeMeasurement({ estimate, ramps, reached }) {
  const said = describeEstimate(estimate);
  if (!(ramps > 1 || reached in REACHED_WORDS)) return said;
  const presses = `${ramps} ${ramps > 1 ? "presses" : "press"} on the lesion${REACHED_WORDS[reached] ?? ""}.`;
  return { ...said, reason: `${said.reason} ${presses}`, tone: reached === false ? "caution" : said.tone };
}

/** The status of an estimate in words, its reason, and whether it is "good" as it stands or a "caution". */
function describeEstimate({ status, reason, ...quantities }) {
  const known = TILES.filter(({ key }) => quantities[key].identifiable === true).length;
  // Measurements of before say not_identifiable also where only a part is.
  const inPart = known > 0 && known < TILES.length && (status === "ok" || status === "not_identifiable");
  const said = inPart ? "partly_identifiable" : status;
  if (said !== "ok") return { word: STATUS_WORDS[said] ?? said, reason, tone: "caution" };
  return { word: "Measured.", reason: reason || "Size, depth and Young's modulus are determined.", tone: "good" };
}
