// Speed or accuracy, chosen before a press: what the probe offers, what each choice costs and how well it measures. A
// probe with one mode asks nothing.

import { byId, element, setAttribute } from "./dom.js";
import { isScan, offerAccuracy } from "./scan.js";

const box = byId("modes");

// What stands in each line of a choice, and its name beside the first one.
const LINES = ["press + answer", "size, depth off by", "answered"];
const LEAST_S = 0.05;

const percent = (ratio) => `${Math.round(100 * ratio)} %`;

/** "0.4 s"; with a tilde while no press has shown it on this probe. */
function answerWords({ answer_s: answer, answer_presses: presses }) {
  if (answer === null) return "?";
  const seconds = answer < LEAST_S ? `${LEAST_S} s` : `${answer.toFixed(answer < 9.5 ? 1 : 0)} s`;
  return `${presses === 0 ? "~" : answer < LEAST_S ? "<" : ""}${seconds}`;
}

/** Time of one of its presses, of a scan how many there are on the lesion, and of the answer; error; share answered. */
function lines(offer) {
  const { seconds, typical_error_percent: error, answered_ratio: answered } = offer;
  const { fewest_ramps: fewest, most_ramps: most } = offer;
  return [
    `${isScan(offer) ? `${fewest}–${most} × ` : ""}${seconds} s + ${answerWords(offer)}`,
    error ? `${Math.round(error.size_mm)} %, ${Math.round(error.depth_mm)} %` : "not stated",
    answered === null ? "not stated" : percent(answered),
  ];
}

function choice(offer, isChosen) {
  const label = element("label", "mode");
  const input = element("input", "");
  const told = lines(offer);
  const words = element("span", "mode-words");
  Object.assign(input, { type: "radio", name: "mode", value: offer.mode, checked: isChosen });
  setAttribute(input, "aria-label", [offer.mode, ...told.map((line, index) => `${LINES[index]} ${line}`)].join("; "));
  words.append(element("span", "mode-name", offer.mode), ...told.map((line) => element("span", "mode-cost", line)));
  label.append(input, words);
  return label;
}

function headings() {
  const words = element("div", "mode-headings");
  words.append(element("span", "mode-name", "\u00a0"), ...LINES.map((line) => element("span", "mode-cost", line)));
  setAttribute(words, "aria-hidden", "true");
  return words;
}

/** Offer the modes of GET /api/v1/device; what is chosen already stays so, at first the probe's own choice. */
export function offerModes({ modes, default_mode: byDefault }) {
  const chosen = modes.some(({ mode }) => mode === chosenMode()) ? chosenMode() : byDefault;
  const old = [...box.querySelectorAll("label, .mode-headings")];
  old.forEach((one) => one.remove());
  box.append(headings(), ...modes.map((offer) => choice(offer, offer.mode === chosen)));
  offerAccuracy(modes);
}

/** Show the choice while there is one. */
export function showModes(mayChoose) {
  box.hidden = !mayChoose || box.querySelectorAll("input").length < 2;
}

/** The mode that is chosen, or undefined before the probe has said what it offers. */
export const chosenMode = () => box.querySelector("input:checked")?.value;
