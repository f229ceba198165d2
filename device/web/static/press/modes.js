// Speed or accuracy, chosen before a press: what the probe offers, what each choice costs and how well it measures. A
// probe with one mode asks nothing.

import { byId, element, setAttribute, setText } from "../base/dom.js";
import { figure, say } from "../base/words.js";
import { isScan, offerAccuracy } from "./scan.js";

const box = byId("modes");
const LEAST_S = 1;
const NEVER_RATIO = 0.02;
let offers = [];

const percent = (ratio) => figure(100 * ratio, 0);

/** Seconds that the presses of a mode are held and its answer takes; of a scan with its fewest and its most presses. */
function heldAndAnswered({ seconds, fewest_ramps: fewest, most_ramps: most, answer_s: answer }) {
  return [fewest, most].map((ramps) => (1 + ramps) * seconds + (answer ?? 0));
}

function timeWords(offer) {
  const [least, most] = heldAndAnswered(offer);
  if (offer.answer_s === null) return say("mode.time_about", { s: figure(Math.max(least, LEAST_S), 0) });
  if (most < LEAST_S) return say("mode.under", { s: LEAST_S });
  const s = isScan(offer) ? `${figure(least, 0)}–${figure(most, 0)}` : figure(least, 0);
  return say(offer.answer_presses ? "mode.time" : "mode.time_about", { s });
}

function errorWords({ typical_error_percent: error }) {
  if (!error) return say("mode.error_unknown");
  return say("mode.error", { size: figure(error.size_mm, 0), depth: figure(error.depth_mm, 0) });
}

const answeredWords = ({ answered_ratio: ratio }) => (ratio === null ? "" : say("mode.answered", { n: percent(ratio) }));

function modulusWords({ determined_ratio: ratio }) {
  const often = ratio?.youngs_modulus_kpa;
  if (often === undefined) return "";
  return often < NEVER_RATIO ? say("mode.modulus_never") : say("mode.modulus_in", { n: percent(often) });
}

export const modeName = (mode) => say(`mode.${mode}`);

/** What a mode is worth, in a phrase. */
export const trade = (offer) => [errorWords(offer), modulusWords(offer)].filter(Boolean).join(", ");

/** All that a low screen has no room for in each choice: of the one that is chosen. */
const worthWords = (offer) => [errorWords(offer), answeredWords(offer), modulusWords(offer)].filter(Boolean).join(", ");

function choice(offer, isChosen) {
  const label = element("label", "mode");
  const input = element("input", "");
  const words = element("span", "mode-words");
  const told = { time: timeWords(offer), error: errorWords(offer), answered: answeredWords(offer), modulus: modulusWords(offer) };
  Object.assign(input, { type: "radio", name: "mode", value: offer.mode, checked: isChosen });
  setAttribute(input, "aria-label", say("mode.told", { name: modeName(offer.mode), ...told }));
  const head = element("span", "mode-head");
  head.append(element("span", "mode-name", modeName(offer.mode)), element("span", "mode-time", told.time));
  const worth = [told.answered, told.modulus].filter(Boolean).join(", ");
  words.append(head, element("span", "mode-cost", told.error), element("span", "mode-cost", worth));
  label.append(input, words);
  return label;
}

/** Offer the modes of GET /api/v1/device; what is chosen already stays so, at first the probe's own choice. */
export function offerModes({ modes, default_mode: byDefault }) {
  const chosen = modes.some(({ mode }) => mode === chosenMode()) ? chosenMode() : byDefault;
  offers = modes;
  box.querySelectorAll("label").forEach((one) => one.remove());
  byId("mode-trade").before(...modes.map((offer) => choice(offer, offer.mode === chosen)));
  offerAccuracy(modes);
}

/** Show the choice while there is one. */
export function showModes(mayChoose) {
  box.hidden = !mayChoose || offers.length < 2;
  setText(byId("mode-trade"), offerOf(chosenMode()) ? worthWords(offerOf(chosenMode())) : "");
}

/** The mode that is chosen, or undefined before the probe has said what it offers. */
export const chosenMode = () => box.querySelector("input:checked")?.value;

const offerOf = (mode) => offers.find((offer) => offer.mode === mode);

/** The status as the gauge is to show it between presses: with the band, forces and images of the mode that is chosen. */
export function asChosen(status) {
  const offer = offerOf(chosenMode());
  if (!offer) return status;
  const { kind, frames, band_n: band, from_n: from, to_n: to } = offer;
  const spacing = (to - from) / Math.max(frames - 1, 1);
  const wanted = Array.from({ length: frames }, (_, index) => from + index * spacing);
  return { ...status, mode: offer.mode, kind, band_n: band, wanted_n: wanted, frames_needed: frames, frames_taken: 0 };
}

/** What would tell more than a measurement did: the mode that determines the modulus most often, or a press beside. */
export function surerWords({ mode, estimate }) {
  if (mode === "quick") return ""; // its own sentence names the mode that checks the tissue
  const isWhole = ["size_mm", "depth_mm", "youngs_modulus_kpa"].every((key) => estimate[key].identifiable);
  const often = (offer) => offer?.determined_ratio?.youngs_modulus_kpa ?? 0;
  const best = offers.reduce((one, other) => (often(other) > often(one) ? other : one), offerOf(mode));
  if (!best || best.mode === mode) return isWhole ? "" : say("result.surer_beside");
  return say("result.surer", { mode: modeName(best.mode), trade: trade(best) });
}

/** Call back when another mode is chosen. */
export const onChoice = (act) => box.addEventListener("change", act);
