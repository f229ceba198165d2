// A scan: how sure each unknown is after every press on the lesion, and, before it begins, how sure it is to be.

import { byId, element, setAttribute, setText } from "../base/dom.js";
import { figure, say, understand } from "../base/words.js";

const STEPS_MM = [1, 0.5, 0.2];
const ASKED = ["size_mm", "depth_mm"];
const ROWS = [
  { key: "size_mm", name: "size", unit: "mm", full: 4 },
  { key: "depth_mm", name: "depth", unit: "mm", full: 4 },
  { key: "youngs_modulus_kpa", name: "modulus", unit: "kPa", full: 40 },
];
const box = byId("until");
let offers = [];
let shown = "";

export const isScan = ({ most_ramps: most }) => most > 1;

const offerOf = (mode) => offers.find((offer) => offer.mode === mode && isScan(offer));

/** The digits that tell a half width from another, and a half width with them: 0.45, 1.2, 14. */
const digits = (halfWidth) => (halfWidth < 0.995 ? 2 : halfWidth < 9.95 ? 1 : 0);
const width = (halfWidth) => figure(halfWidth, digits(halfWidth));

/** A half width that can be had, rounded up: what is named is not refused. */
const atLeast = (halfWidth) => width(Math.ceil(halfWidth * 10 ** digits(halfWidth)) / 10 ** digits(halfWidth));

/** How sure a scan can be at best (mm), as far as the probe knows; only the sizes in mm are asked for here. */
const nearest = ({ reachable_half_width: reachable }) => Math.max(...ASKED.map((key) => reachable?.[key] ?? 0));

/** In how many of ten inclusions a scan of all its presses is as sure as that at most; null where nobody knows. */
function reachedOfTen({ half_width_by_ramps: byRamps, most_ramps: most }, step) {
  const widths = byRamps?.[most];
  if (!widths) return null;
  const shares = ASKED.map((key) => widths[key].filter((one) => one <= step).length / (widths[key].length + 1));
  return Math.floor(10 * Math.min(...shares));
}

function choice(step, isPossible, told = "") {
  const label = element("label", "until-step");
  const input = element("input", "");
  const words = step === null ? say("until.any") : say("until.mm", { mm: figure(step, step < 1 ? 1 : 0) });
  Object.assign(input, { type: "radio", name: "until", value: step ?? "", checked: step === null, disabled: !isPossible });
  const shown = element("span", "");
  shown.append(element("b", "", words));
  if (told) shown.append(element("small", "", told));
  label.append(input, shown);
  if (!isPossible) setAttribute(label, "title", say("until.not"));
  return label;
}

/** The choices in mm: in how many of ten each is reached; the first that cannot be had tells the nearest that can. */
function steps(offer) {
  const best = nearest(offer);
  const tooSure = STEPS_MM.find((step) => step < best);
  return STEPS_MM.map((step) => {
    if (step < best) return choice(step, false, step === tooSure ? say("until.nearest", { mm: atLeast(best) }) : "");
    const ofTen = reachedOfTen(offer, step);
    return choice(step, true, ofTen === null ? "" : say("until.of_ten", { n: ofTen }));
  });
}

/** Offer how sure a scan is to be; what was chosen stays so while it can be had. */
export function offerAccuracy(modes) {
  const offer = modes.find(isScan);
  const chosen = box.querySelector("input:checked")?.value;
  offers = modes;
  box.querySelectorAll("label, .until-words").forEach((one) => one.remove());
  if (!offer) return;
  box.append(element("span", "until-words", say("until.words")));
  box.append(choice(null, true), ...steps(offer));
  const again = [...box.querySelectorAll("input")].find(({ value, disabled }) => value === chosen && !disabled);
  if (again) again.checked = true;
}

/** Show that choice where the mode that is chosen is a scan. */
export function showAccuracy(mode) {
  box.hidden = !offerOf(mode);
}

/** What a scan is asked for: nothing, or half of the 90 % interval of size and depth. */
export function chosenAccuracy(mode) {
  const step = Number(box.querySelector("input:checked")?.value);
  return offerOf(mode) && step ? { until: { size_mm: step, depth_mm: step } } : {};
}

/** What a scan is doing, in words; "" when there is no scan, or nothing that differs from any other press. */
export function scanHint({ step, scan, press_state: state }, mode) {
  const offer = offerOf(mode);
  if (!offer) return "";
  if (step === "ready") return say(reachedOfTen(offer, 0) === null ? "hint.scan_ready" : "hint.scan_told");
  if (step === "lesion" && state === "releasing") return say("hint.scan_answering");
  if (step !== "lesion" || !scan) return "";
  return say("hint.scan_next", { n: scan.ramps + 1, mm: figure(scan.next_offset_mm, 0) });
}

/** What the operator has to know before the next press: that the last one does not count, or that nothing is known. */
export function scanTrouble({ step, scan, guidance }) {
  if (step !== "lesion" || !scan || !["lift", "move_aside"].includes(guidance.code)) return null;
  const why = (text) => understand(text)?.why ?? say("reason.other");
  if (scan.failed) return { word: say("scan.not_counted"), reason: why(scan.failed), tone: "caution" };
  const hasNumbers = Object.keys(scan.half_width).length > 0;
  return hasNumbers ? null : { word: say("scan.no_numbers"), reason: why(scan.reason), tone: "caution" };
}

function bar(now, next, wanted, full) {
  const track = element("div", "scan-bar");
  const part = (className, value) => {
    const node = element("span", className);
    node.style.setProperty("--to", Math.min(value / full, 1));
    track.append(node);
  };
  part("scan-now", now);
  if (next !== undefined) part("scan-next", next);
  if (wanted !== undefined) part("scan-wanted", wanted);
  return track;
}

/** Value and half width of one unknown, what the next press is expected to make of it, and what is asked for. */
function row({ key, name, unit, full }, scan, until) {
  const item = element("li", "scan-row");
  const now = scan.half_width[key];
  const [next, wanted, value] = [scan.expected_half_width[key], until?.[key], scan.value[key]];
  const isKnown = now !== undefined && scan.determined[key];
  item.dataset.reached = wanted !== undefined && now <= wanted;
  item.dataset.known = isKnown;
  const words = isKnown ? `${figure(value, now >= 9.95 ? 0 : 1)} ± ${width(now)} ${unit}` : say("scan.unknown");
  item.append(element("span", "scan-name", say(name)), element("strong", "scan-value", words));
  if (now !== undefined) item.append(bar(now, next, wanted, full));
  const told = element("span", "scan-told", next === undefined ? "" : say("scan.next", { width: width(next), unit }));
  if (wanted !== undefined) told.append(" ", element("span", "scan-asked", say("scan.asked", { width: width(wanted), unit })));
  item.append(told);
  return item;
}

/** Show how sure each unknown is, once a press of a scan is complete. */
export function showScan({ scan, press }) {
  const key = JSON.stringify([scan, press?.until]);
  if (key === shown) return;
  shown = key;
  byId("scan").hidden = !scan;
  byId("panel").dataset.scan = Boolean(scan);
  if (!scan) return;
  byId("scan-rows").replaceChildren(...ROWS.map((one) => row(one, scan, press?.until)));
  setText(byId("scan-count"), say("scan.count", { n: scan.ramps, most: scan.most_ramps }));
}
