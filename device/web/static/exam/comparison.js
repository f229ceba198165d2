// Two measurements side by side: pictures, values with their intervals, and the difference where both determine it.

import { byId, element } from "../base/dom.js";
import { imageUrl } from "../base/probe.js";
import { figure, moment, say } from "../base/words.js";
import { UNKNOWNS, isDetermined, shortWords } from "../result/quantities.js";

function picture({ id, seq }) {
  const image = element("img", "thumbnail thumbnail-large");
  Object.assign(image, { src: imageUrl(id), alt: say("picture", { n: seq }) });
  return image;
}

function line(name, cells) {
  const row = element("tr", "");
  const head = element("th", "", name);
  head.scope = "row";
  row.append(head, ...cells.map((cell) => {
    const data = element("td", "");
    data.append(cell);
    return data;
  }));
  return row;
}

function difference([one, other], { key, unit }) {
  if (![one, other].every(({ estimate }) => isDetermined(estimate, key))) return "–";
  const apart = other.estimate[key].value - one.estimate[key].value;
  return `${apart > 0 ? "+" : ""}${figure(apart, 1)} ${unit}`;
}

/** Show two measurements, the older one first; fewer than two are none. */
export function showComparison(measurements) {
  const box = byId("comparison");
  byId("compare-hint").hidden = measurements.length === 2;
  box.hidden = measurements.length < 2;
  if (measurements.length < 2) return;
  const pair = [...measurements].sort((a, b) => a.seq - b.seq);
  const rows = UNKNOWNS.map((one) => line(say(one.name), [...pair.map(({ estimate }) => shortWords(estimate, one)), difference(pair, one)]));
  box.replaceChildren(
    line("", [...pair.map(({ taken_at: at }) => moment(at)), say("history.difference")]),
    line("", [...pair.map(picture), ""]),
    ...rows,
  );
  box.scrollIntoView({ block: "start" }); // the marks may be far below
}
