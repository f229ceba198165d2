// The three unknowns of an estimate as words: value, 90 % interval, and nothing where nothing is determined.

import { figure, say } from "../base/words.js";

export const UNKNOWNS = [
  { name: "size", key: "size_mm", unit: "mm" },
  { name: "depth", key: "depth_mm", unit: "mm" },
  { name: "modulus", key: "youngs_modulus_kpa", unit: "kPa" },
];
const WITHOUT_NUMBERS = new Set(["no_contact", "saturated", "rejected", "outside_range"]);

/** Digits that the interval supports: whole units once it is ten units wide. */
const decimalsFor = (quantity) => (quantity.high - quantity.low >= 10 ? 0 : 1);

export const isBounded = (quantity) => Number.isFinite(quantity.low) && Number.isFinite(quantity.high);

/** Whether an estimate determines an unknown, so that its value may be said. */
export function isDetermined({ status, ...quantities }, key) {
  return !WITHOUT_NUMBERS.has(status) && quantities[key].identifiable === true && Number.isFinite(quantities[key].value);
}

export const valueFigure = (quantity) => figure(quantity.value, decimalsFor(quantity));

/** The interval in words. Where it ends with the trained range it is open: the truth may as well lie beyond. */
export function intervalWords(quantity, unit) {
  const { low_is_open: lowOpen, high_is_open: highOpen } = quantity;
  const [low, high] = [quantity.low, quantity.high].map((end) => figure(end, decimalsFor(quantity)));
  if (lowOpen && highOpen) return say("result.any");
  if (!lowOpen && !highOpen) return say("result.range", { low, high, unit });
  return lowOpen ? say("result.or_less", { value: high, unit }) : say("result.or_more", { value: low, unit });
}

/** A measurement's value of one unknown in short, as "12.2 (11.7 – 12.9 mm)". */
export function shortWords(estimate, { key, unit }) {
  if (!isDetermined(estimate, key)) return say("result.not_determined");
  return `${valueFigure(estimate[key])} (${intervalWords(estimate[key], unit)})`;
}
