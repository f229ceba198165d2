// The tactile image in mm: a scale bar, colours of fixed limits, the dot of the probe's case, and the bright spot's
// centre. The file itself says how large its pixels are and what its brightest colour means; one of before says neither.

import { byId, drawn, setText } from "../base/dom.js";
import { imageUrl } from "../base/probe.js";
import { figure, say } from "../base/words.js";

const BAR_MM = 5;
const CHUNKS_AT = 8; // after the signature of a PNG
const FULL_KEYWORD = "full_contrast\0";
let shownId = null;

const asText = (bytes) => String.fromCharCode(...bytes);

/** What a PNG says of itself: {width, height} in pixels, mmPerPx and fullContrast, null where it does not say. */
export function read(buffer) {
  const [view, bytes] = [new DataView(buffer), new Uint8Array(buffer)];
  const found = { width: view.getUint32(16), height: view.getUint32(20), mmPerPx: null, fullContrast: null };
  for (let at = CHUNKS_AT; at < bytes.length; ) {
    const [length, kind] = [view.getUint32(at), asText(bytes.subarray(at + 4, at + 8))];
    if (kind === "IDAT") break;
    if (kind === "pHYs") found.mmPerPx = 1000 / view.getUint32(at + 8);
    const text = kind === "tEXt" ? asText(bytes.subarray(at + 8, at + 8 + length)) : "";
    if (text.startsWith(FULL_KEYWORD)) found.fullContrast = Number(text.slice(FULL_KEYWORD.length));
    at += 12 + length;
  }
  return found;
}

/** What is drawn over the image, in its pixels: bar, dot at +x, and the centre where the press knows it. */
function marks({ width, height, mmPerPx }, features) {
  const svg = byId("image-marks");
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  if (!mmPerPx) return svg.replaceChildren();
  const [bar, edge] = [BAR_MM / mmPerPx, width * 0.04];
  const nodes = [
    drawn("path", { class: "bar", d: `M${edge} ${height - edge}h${bar}` }),
    drawn("text", { x: edge + bar / 2, y: height - edge * 1.7, class: "bar-words" }, say("picture.scale", { mm: BAR_MM })),
    drawn("circle", { class: "dot", cx: width - edge, cy: height / 2, r: edge * 0.5 }),
  ];
  const { centroid_x_mm: x, centroid_y_mm: y } = features ?? {};
  if (Number.isFinite(x) && Number.isFinite(y)) {
    const [cx, cy, arm] = [width / 2 + x / mmPerPx, height / 2 + y / mmPerPx, width * 0.05];
    nodes.push(drawn("path", { class: "centre", d: `M${cx - arm} ${cy}h${2 * arm}M${cx} ${cy - arm}v${2 * arm}` }));
  }
  svg.replaceChildren(...nodes);
}

function showScale({ fullContrast }) {
  const most = fullContrast ? say("picture.percent", { n: figure(100 * fullContrast, 0) }) : "";
  byId("colour-scale").hidden = !fullContrast;
  byId("colour-relative").hidden = Boolean(fullContrast);
  setText(byId("colour-most"), most);
}

/** Show the picture of a measurement, or that it follows while the measurement is being kept. */
export async function showPicture({ id, seq, features }) {
  const image = byId("image");
  image.alt = id ? say("picture", { n: seq }) : say("picture.kept_soon");
  if (id === shownId) return;
  shownId = id;
  image.removeAttribute("src"); // the one before would stay in sight until this one is there
  for (const one of ["colour-scale", "colour-relative"]) byId(one).hidden = true;
  byId("image-marks").replaceChildren();
  if (!id) return;
  image.src = imageUrl(id);
  const response = await fetch(imageUrl(id)).catch(() => null);
  const bytes = response?.ok && (await response.arrayBuffer());
  if (!bytes || shownId !== id) return; // another is shown meanwhile
  const told = read(bytes);
  marks(told, features);
  showScale(told);
}
