// Say that a measurement does not count, with a reason; it stays readable.

import { button, byId, setText } from "../base/dom.js";
import { remember, remembered } from "../base/memory.js";
import { voidMeasurement } from "../base/probe.js";
import { reasonToKeep, say } from "../base/words.js";
import { openExam } from "./current.js";

const REASONS = ["slipped", "place", "patient", "other"];
const dialog = byId("void");
const by = byId("void-by");
let measurement = null;
let done = () => {};

async function act(reason) {
  const who = by.value.trim();
  if (!who) {
    setText(byId("void-problem"), say("void.missing_by"));
    by.focus();
    return;
  }
  remember("operator", who);
  try {
    const after = await voidMeasurement(measurement, { by: who, reason: reasonToKeep(reason) });
    dialog.close();
    done(after);
  } catch (error) {
    setText(byId("void-problem"), error.message);
  }
}

byId("void-reasons").append(...REASONS.map((reason) => button("button button-quiet", say(`void.${reason}`), () => act(reason))));
byId("void-close").addEventListener("click", () => dialog.close());

/** Ask why a measurement does not count; `onDone` is called with it as it is then. */
export function askVoid(which, onDone) {
  measurement = which;
  done = onDone;
  by.value = openExam()?.operator ?? remembered("operator") ?? "";
  setText(byId("void-problem"), "");
  dialog.showModal();
}
