// The menu: what is needed now and then, and on small screens what stands at the foot of larger ones.

import { byId, setText } from "./dom.js";
import { moment, say } from "./words.js";

const TICK_MS = 10000;
const dialog = byId("menu");

function showClock() {
  setText(byId("clock"), `${say("menu.clock")} ${moment(Date.now())}`);
}

/** Say which probe this is. */
export function showIdentity({ serial, software }) {
  setText(byId("serial"), `${say("menu.serial")} ${serial}`);
  setText(byId("software"), say("software.version", { version: software }));
}

byId("menu-open").addEventListener("click", () => { showClock(); dialog.showModal(); });
byId("menu-close").addEventListener("click", () => dialog.close());
for (const [from, to] of [["menu-history", "history-open"], ["menu-tare", "tare"]]) {
  byId(from).addEventListener("click", () => { dialog.close(); byId(to).click(); });
}
showClock();
setInterval(showClock, TICK_MS);
