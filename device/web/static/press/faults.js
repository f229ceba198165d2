// Faults and warnings: a code, what it means and what to do, in the operator's words and never cut off. What the daemon
// measured and what service does stands one tap away.

import { button, byId, element } from "../base/dom.js";
import { isSaid, say, understandRest } from "../base/words.js";

// Rows that fit the screen whole, on one of 800 x 480 and on a lower one; the others are counted.
const AT_MOST = { high: { fault: 3, warning: 2 }, low: { fault: 2, warning: 1 } };
const lowScreen = matchMedia("(max-height: 419px)");
const box = byId("faults");
const dialog = byId("fault-details");
let shown = "";
let known = [];

const part = (code, name) => (isSaid(`fault.${code}.${name}`) ? say(`fault.${code}.${name}`) : say(`fault.other.${name}`, { code }));

/** What to do about a fault; of one that ends by itself with how long that takes, where the daemon says so. */
export function remedyOf({ code, remedy }) {
  return understandRest(code, remedy) ?? part(code, "do");
}

export const meaningOf = ({ code }) => part(code, "is");

/** One row; of a warning beside a press that is under way, or beside a fault, only what it is: both say what to do. */
function item(fault, isRemedySaid) {
  const node = element("div", "fault");
  node.dataset.severity = fault.severity;
  const words = element("p", "fault-words");
  words.append(element("strong", "fault-title", meaningOf(fault)));
  if (isRemedySaid || fault.severity === "fault") words.append(" ", element("span", "fault-remedy", remedyOf(fault)));
  node.append(element("span", "fault-code", fault.code), words);
  return node;
}

function open() {
  byId("fault-list").replaceChildren(...known.flatMap((fault) => [
    element("dt", "", `${fault.code} ${meaningOf(fault)}`),
    element("dd", "", `${say("faults.what")}: ${fault.cause}`),
    element("dd", "", `${say("faults.remedy")}: ${fault.remedy}`),
  ]));
  dialog.showModal();
}

/** Open what the daemon itself said, for service. */
export function openService(words) {
  byId("fault-list").replaceChildren(element("dt", "", say("faults.what")), element("dd", "", words));
  dialog.showModal();
}

byId("fault-close").addEventListener("click", () => dialog.close());

/** Show the faults of a status, worst first; without one nothing is there. */
export function showFaults({ faults, step }, isPressUnderWay) {
  const rowsThatFit = AT_MOST[lowScreen.matches ? "low" : "high"];
  const isRemedySaid = step !== "fault" && !isPressUnderWay;
  const key = JSON.stringify([faults, step === "fault", isRemedySaid, rowsThatFit]);
  if (key === shown) return;
  shown = key;
  known = [...faults].sort((a, b) => (a.severity > b.severity) - (a.severity < b.severity));
  const most = rowsThatFit[step === "fault" ? "fault" : "warning"];
  const first = known.slice(0, most);
  const rows = element("div", "fault-rows");
  rows.append(...first.map((one) => item(one, isRemedySaid)));
  const more = button("button button-quiet fault-open", say("details"), open);
  more.setAttribute("aria-label", say("faults.details"));
  const side = element("div", "fault-side");
  side.append(more);
  if (known.length > most) side.append(element("p", "fault-more", say("faults.more", { n: known.length - most })));
  box.replaceChildren(...(known.length ? [rows, side] : []));
  box.hidden = known.length === 0;
  box.dataset.severity = known[0]?.severity ?? "";
  byId("panel").classList.toggle("with-faults", known.length > 0);
}
