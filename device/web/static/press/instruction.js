// One sentence a state: what to do first, large, and below it the reason or what helps.

import { byId, setAttribute, setText } from "../base/dom.js";
import { figure, isSaid, say, understand } from "../base/words.js";
import { meaningOf, remedyOf } from "./faults.js";

const ICONS = {
  choose: "who", press_beside: "press", press_lesion: "press", press_harder: "harder", press_lighter: "lighter",
  touch_beside: "press", touch_lesion: "press", move_aside: "aside", press_slowly: "harder", slower: "wait",
  keep_free: "lift", hold_block: "press", put_weight: "press", take_weight_off: "lift",
  hold_still: "hold", lift: "lift", done: "done", look: "look", rejected: "rejected", cancelled: "lift", fault: "fault",
};
const TONES = { hold_still: "good", slower: "caution", done: "good", look: "caution", rejected: "caution", fault: "bad" };
const LONG = 34; // characters; more would need a third line
const panel = byId("panel");

/** What to do, in words; of a move aside with how far, where the probe says so. */
export function guidanceWords({ guidance: { code }, scan }) {
  if (code === "move_aside" && scan) return say("guidance.move_aside_mm", { mm: figure(scan.next_offset_mm, 0) });
  return say(`guidance.${code}`);
}

/** What helps in a step of a press, "" where nothing has to be said. */
export function stepHint({ step, kind, guidance }) {
  if (step === "starting" && guidance?.code === "lift") return say("hint.starting_lift");
  if (kind === "ramp" && isSaid(`hint.ramp_${step}`)) return say(`hint.ramp_${step}`);
  return isSaid(`hint.${step}`) ? say(`hint.${step}`) : "";
}

/** How a press ended without a measurement: {word, reason, service}, or null; what a fault shows is not said again. */
export function endWords({ press, faults }) {
  if (!["rejected", "cancelled", "failed"].includes(press?.state)) return null;
  if (press.state === "cancelled") return { word: say("ended.cancelled"), reason: say("ended.cancelled.why") };
  if (press.code) {
    const isShown = faults.some(({ code }) => code === press.code);
    const fault = { code: press.code, remedy: press.reason.replace(/^.*?(?=Wait \d)/s, "") };
    const reason = isShown ? "" : `${meaningOf(fault)}. ${remedyOf(fault)}`;
    return { word: say(`ended.${press.state}`), reason, service: press.reason };
  }
  const said = understand(press.reason);
  if (said) return { word: said.do || say(`ended.${press.state}`), reason: said.why };
  const isFault = faults.length > 0;
  return { word: say(`ended.${press.state}`), reason: isFault ? "" : say("reason.other"), service: press.reason };
}

/** Write the instruction: its words, its icon and tone by a code, and the line below it. */
export function showInstruction(code, words, { word = "", reason = "", tone = "calm" }) {
  setText(byId("instruction"), words);
  setAttribute(byId("instruction-icon"), "href", `#icon-${ICONS[code] ?? "wait"}`);
  byId("instruction").classList.toggle("long", words.length > LONG);
  panel.dataset.tone = TONES[code] ?? "calm";
  setText(byId("status-word"), word);
  setText(byId("status-reason"), reason);
  byId("status-line").dataset.tone = tone;
}
