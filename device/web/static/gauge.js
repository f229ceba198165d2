// The force gauge: one number against a narrow target band, or against a ramp whose open targets are marked. Positions
// are ratios of the full scale, moved by CSS alone.

import { byId, element, setAttribute, setQuantity, setText } from "./dom.js";

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
  if (kind === "ramp") return `slowly from ${low.toFixed(2)} to ${high.toFixed(2)} N`;
  return `target ${low.toFixed(3)} – ${high.toFixed(3)} N`;
}

function drawScale({ kind, full_scale_n: fullScale, band_n: [low, high] }) {
  const scale = [kind, fullScale, low, high].join();
  if (scale === drawnScale) return;
  drawnScale = scale;
  panel.style.setProperty("--band-start", low / fullScale);
  panel.style.setProperty("--band-width", (high - low) / fullScale);
  setText(byId("force-band-text"), bandWords(kind, low, high));
  setAttribute(track, "aria-valuemax", fullScale);
  const step = tickStep(fullScale);
  const ticks = [];
  for (let tick = 0; tick <= fullScale * 1.001; tick += step) {
    const node = element("span", "", step < 0.1 ? tick.toFixed(2) : tick.toFixed(1));
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

const ZONE_WORDS = {
  hold: { below: "below target", in: "in target band", above: "above target" },
  ramp: { below: "below the ramp", in: "on the ramp", above: "above the ramp" },
};
const ANY_ZONE_WORDS = { unknown: "no force reading", over: "over full scale" };

/** Show status.force_n (N, or null when the load cell is silent) on a scale from 0 to status.full_scale_n. */
export function showGauge(status) {
  const { force_n: force, band_n: band, full_scale_n: fullScale } = status;
  drawScale(status);
  drawWanted(status);
  const zone = zoneOf(force, band, fullScale);
  const word = ANY_ZONE_WORDS[zone] ?? ZONE_WORDS[status.kind][zone];
  const figure = zone === "unknown" ? "–" : force.toFixed(2).replace("-0.00", "0.00");
  panel.dataset.zone = zone;
  panel.style.setProperty("--force-ratio", Math.min(Math.max(force / fullScale || 0, 0), 1).toFixed(4));
  setQuantity(byId("force-value"), figure, "N");
  setText(byId("force-word"), word);
  setAttribute(track, "aria-valuenow", zone === "unknown" ? 0 : figure);
  setAttribute(track, "aria-valuetext", `${figure} N, ${word}`);
}
