// Speed or accuracy, chosen before a press: what the probe offers, and what each choice costs. A probe with one mode
// asks nothing.

import { byId, element } from "./dom.js";

const box = byId("modes");

/** "10 frames, 3 s": what one of the two presses takes. */
function costWords({ frames, seconds }) {
  return `${frames} ${frames === 1 ? "frame" : "frames"}, ${seconds} s`;
}

function choice(cost, isChosen) {
  const label = element("label", "mode");
  const input = element("input", "");
  Object.assign(input, { type: "radio", name: "mode", value: cost.mode, checked: isChosen });
  const words = element("span", "mode-words");
  words.append(element("span", "mode-name", cost.mode), element("span", "mode-cost", costWords(cost)));
  label.append(input, words);
  return label;
}

/** Offer the modes of GET /api/v1/device; the probe's own choice is made already. */
export function offerModes({ modes, default_mode: byDefault }) {
  const old = [...box.querySelectorAll("label")];
  old.forEach((label) => label.remove());
  box.append(...modes.map((cost) => choice(cost, cost.mode === byDefault)));
}

/** Show the choice while there is one. */
export function showModes(mayChoose) {
  box.hidden = !mayChoose || box.querySelectorAll("input").length < 2;
}

/** The mode that is chosen, or undefined before the probe has said what it offers. */
export const chosenMode = () => box.querySelector("input:checked")?.value;
