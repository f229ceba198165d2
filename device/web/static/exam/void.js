// Say that a measurement does not count, with a reason; it stays readable. One of another patient or place may be moved there.

import { button, byId, setText } from "../base/dom.js";
import { remember, remembered } from "../base/memory.js";
import { voidMeasurement } from "../base/probe.js";
import { reasonToKeep, say } from "../base/words.js";
import { openExam } from "./current.js";
import { chooseMove } from "./move.js";

const REASONS = ["slipped", "place", "patient", "other"];
const dialog = byId("void");
const MOVABLE = new Set(["place", "patient"]); // what was measured may be another exam's, and count there
const by = byId("void-by");
let reasonNow = null;
let measurement = null;
let done = () => {};
let moved = () => {};

/** Who says so, or null when that is missing, and said. */
function sayer() {
  const who = by.value.trim();
  if (who) remember("operator", who);
  else by.focus();
  setText(byId("void-problem"), who ? "" : say("void.missing_by"));
  return who || null;
}

/** A measurement of another patient or place is offered to be moved before it is void. */
function choose(reason) {
  reasonNow = reason;
  if (!sayer()) return;
  if (MOVABLE.has(reason)) offerMove(true);
  else act(reason);
}

function offerMove(on) {
  byId("void-reasons").hidden = on;
  byId("void-or-move").hidden = !on;
  if (on) byId("void-move").focus();
}

function move() {
  const [who, reason] = [sayer(), reasonToKeep(reasonNow)];
  if (!who) return;
  dialog.close();
  chooseMove(measurement, (one, exam) => moved(one, exam, { by: who, reason }));
}

async function act(reason) {
  const who = sayer();
  if (!who) return;
  try {
    const after = await voidMeasurement(measurement, { by: who, reason: reasonToKeep(reason) });
    dialog.close();
    done(after);
  } catch (error) {
    setText(byId("void-problem"), error.message);
  }
}

byId("void-reasons").append(...REASONS.map((reason) => button("button button-quiet", say(`void.${reason}`), () => choose(reason))));
byId("void-yes").addEventListener("click", () => act(reasonNow));
byId("void-move").addEventListener("click", move);
byId("void-close").addEventListener("click", () => dialog.close());

/** Ask why a measurement does not count; `onDone` is called with it as it is then, `onMove` with it, an exam, and who says why. */
export function askVoid(which, onDone, onMove) {
  measurement = which;
  [done, moved] = [onDone, onMove];
  offerMove(false);
  by.value = openExam()?.operator ?? remembered("operator") ?? "";
  setText(byId("void-problem"), "");
  dialog.showModal();
}
