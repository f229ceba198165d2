// Files to take away: a link that downloads. The probe's panel has no place for a file, and says where it can be had.

import { button, byId, element, setText } from "./dom.js";
import { isPanel } from "./panel.js";
import { fetchDevice } from "./probe.js";
import { say } from "./words.js";

const dialog = byId("elsewhere");
byId("elsewhere-close").addEventListener("click", () => dialog.close());

/** Say at which address another machine has it; asked each time, for the answer may be another one after a restart. */
async function sayWhere(words) {
  setText(byId("elsewhere-heading"), words);
  setText(byId("elsewhere-how"), "");
  byId("elsewhere-served").hidden = true;
  dialog.showModal();
  const { network } = await fetchDevice();
  byId("elsewhere-served").hidden = !network;
  setText(byId("elsewhere-address"), network?.url ?? "");
  setText(byId("elsewhere-how"), network ? say("elsewhere.served", { pair: say("menu.pair") }) : say("elsewhere.alone"));
}

/** A file of the probe in words; where it is kept it is called as the probe calls it. */
export function fileLink(words, url) {
  if (isPanel()) return button("button button-quiet", words, () => sayWhere(words).catch(({ message }) => setText(byId("elsewhere-how"), message)));
  return Object.assign(element("a", "button button-quiet", words), { href: url, download: "" });
}
