// The three unknowns of an estimate as words: value, 90 % interval, and nothing where nothing is determined.

import { figure, say } from "../base/words.js";

export const UNKNOWNS = [
  { name: "size", key: "size_mm", unit: "mm" },
  { name: "depth", key: "depth_mm", unit: "mm" },
  { name: "modulus", key: "youngs_modulus_kpa", unit: "kPa" },
];
const WITHOUT_NUMBERS = new Set(["no_contact", "saturated", "rejected", "outside_range"]);

const [FEWEST_UNITS, MOST_DECIMALS] = [3, 2]; // device/measurement/shown_quantity.py has the same rule, and its source
const SAME = 1e-6; // of a last digit's unit: an end that lies so near a multiple of it is that multiple

/** Digits that the interval supports: half of it is three units of the last one or more. */
export function decimalsFor({ low, high }) {
  let decimals = 0;
  while (decimals < MOST_DECIMALS && !((high - low) / 2 >= FEWEST_UNITS * 10 ** -decimals)) decimals += 1;
  return decimals;
}

export const isBounded = (quantity) => Number.isFinite(quantity.low) && Number.isFinite(quantity.high);

/** Whether the truth may lie beyond an end of an interval, where nothing was tried. */
export const hasOpenEnd = ({ low_is_open: low, high_is_open: high }) => Boolean(low || high);

/** Whether an estimate determines an unknown, so that its value may be said. */
export function isDetermined({ status, ...quantities }, key) {
  const quantity = quantities[key];
  return !WITHOUT_NUMBERS.has(status) && quantity.identifiable === true && Number.isFinite(quantity.value) && isBounded(quantity);
}

/** The hash of what answered: of the model's card, or of the network in measurements of before, which say no card. */
export const modelOf = ({ model_card_sha256: card, model_sha256: network }) => card || network;

/** By what a measurement was made: those of several methods differ by more than presses of one do. */
export const methodOf = ({ mode, estimate }) => `${mode} ${modelOf(estimate)} ${estimate.simulated}`;

export const valueFigure = (quantity) => figure(quantity.value, decimalsFor(quantity));

/** The ends of an interval as they are written, rounded outwards: what is read is never narrower than what was measured. */
export function shownEnds({ low, high }, write = figure) {
  const decimals = decimalsFor({ low, high });
  const units = 10 ** decimals;
  const ends = [Math.floor(low * units + SAME) / units, Math.ceil(high * units - SAME) / units];
  return ends.map((end) => write(end, decimals));
}

/** The interval in words. Where it ends with the trained range it is open: the truth may as well lie beyond. */
export function intervalWords(quantity, unit) {
  const { low_is_open: lowOpen, high_is_open: highOpen } = quantity;
  const [low, high] = shownEnds(quantity);
  if (lowOpen && highOpen) return say("result.any");
  if (!lowOpen && !highOpen) return say("result.range", { low, high, unit });
  return lowOpen ? say("result.or_less", { value: high, unit }) : say("result.or_more", { value: low, unit });
}

/** A measurement's value of one unknown in short, as "12.2 (11.7 – 12.9 mm)". */
export function shortWords(estimate, { key, unit }) {
  if (!isDetermined(estimate, key)) return say("result.not_determined");
  return `${valueFigure(estimate[key])} (${intervalWords(estimate[key], unit)})`;
}
