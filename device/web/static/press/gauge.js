// The force gauge: one number against a narrow target band, or against a ramp whose open targets are marked. Positions
// are ratios of the full scale, moved by CSS alone.

import { byId, element, setAttribute, setQuantity, setText } from "../base/dom.js";
import { figure, say } from "../base/words.js";

const panel = byId("panel");
const track = byId("gauge-track");
let drawnScale = "";
let drawnWanted = "";

/** The step of 1, 2 or 5 times a power of ten that gives at least three intervals over the full scale. */
function tickStep(fullScale) {
  const decade = 10 ** Math.floor(Math.log10(fullScale / 3));
  return [5, 2, 1].map((factor) => factor * decade).find((step) => step <= (fullScale / 3) * 1.001);
}

function bandWords(kind, low, high) {
  const decimals = kind === "ramp" ? 2 : 3;
  return say(`force.band.${kind}`, { low: figure(low, decimals), high: figure(high, decimals) });
}

function drawScale({ kind, full_scale_n: fullScale, band_n: [low, high] }) {
  const scale = [kind, fullScale, low, high].join();
  if (scale === drawnScale) return;
  drawnScale = scale;
  panel.style.setProperty("--band-start", low / fullScale);
  panel.style.setProperty("--band-width", (high - low) / fullScale);
  panel.style.setProperty("--band-middle", (low + high) / 2 / fullScale);
  setText(byId("force-band-text"), bandWords(kind, low, high));
  setAttribute(track, "aria-valuemax", fullScale);
  const step = tickStep(fullScale);
  const ticks = [];
  for (let tick = 0; tick <= fullScale * 1.001; tick += step) {
    const node = element("span", "", figure(tick, step < 0.1 ? 2 : 1));
    node.style.setProperty("--at", tick / fullScale);
    ticks.push(node);
  }
  ticks.at(-1).append(" N");
  byId("gauge-ticks").replaceChildren(...ticks);
}

/** Mark the forces of a ramp at which a frame is still wanted; a hold has its band. */
function drawWanted({ kind, wanted_n: wanted, band_n: [low, high], full_scale_n: fullScale, frames_needed: needed }) {
  const key = [kind, needed, low, ...wanted].join();
  if (key === drawnWanted) return;
  drawnWanted = key;
  const spacing = (high - low) / (needed - 1);
  const cells = (kind === "ramp" ? wanted : []).map((force) => {
    const cell = element("span", "");
    cell.style.setProperty("--from", (force - spacing / 2) / fullScale);
    cell.style.setProperty("--width", spacing / fullScale);
    return cell;
  });
  byId("force-wanted").replaceChildren(...cells);
}

/** "below", "in" or "above" the band, or "over" the scale; "unknown" without a force. */
function zoneOf(force, [low, high], fullScale) {
  if (!Number.isFinite(force)) return "unknown";
  if (force > fullScale) return "over";
  if (force > high) return "above";
  return force < low ? "below" : "in";
}

/** Show status.force_n (N, or null when the load cell is silent) on a scale from 0 to status.full_scale_n. */
export function showGauge(status) {
  const { kind, force_n: force, band_n: band, full_scale_n: fullScale } = status;
  drawScale(status);
  drawWanted(status);
  const zone = zoneOf(force, band, fullScale);
  const word = say(zone === "unknown" || zone === "over" ? `force.${zone}` : `force.${kind}.${zone}`);
  const value = zone === "unknown" ? "–" : figure(force, 2);
  panel.dataset.zone = zone;
  panel.style.setProperty("--force-ratio", Math.min(Math.max(force / fullScale || 0, 0), 1).toFixed(4));
  setQuantity(byId("force-value"), value, "N");
  setText(byId("force-word"), word);
  setAttribute(track, "aria-valuenow", zone === "unknown" ? 0 : force.toFixed(2));
  setAttribute(track, "aria-valuetext", `${value} N, ${word}`);
}
