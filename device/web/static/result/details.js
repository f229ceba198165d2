// Everything behind a measurement, in a researcher's words and the daemon's own: features, frames, force, model.

import { byId, element } from "../base/dom.js";
import { fetchForces, recordingUrl } from "../base/probe.js";
import { fileLink } from "../base/take_away.js";
import { exact, figure, moment, say } from "../base/words.js";
import { modeName } from "../press/modes.js";
import { forceCurve } from "./force_curve.js";
import { modelOf } from "./quantities.js";

const dialog = byId("details");
let shownId = null;
byId("details-close").addEventListener("click", () => dialog.close());

function warningWords({ code, title, cause, remedy }) {
  return `${code} ${title}: ${cause} ${remedy}`;
}

/** Which probe and software measured; older measurements say neither. */
const proberWords = ({ serial, software }) => [serial, software && say("details.software", { version: software })].filter(Boolean).join(", ");

function lines(measurement) {
  const { taken_at: at, mode, frames, force_n: force, estimate, features, warnings, exam_id: exam, recording_id: recording } = measurement;
  const of = { mode: modeName(mode), frames, force: figure(force, 3) };
  return [
    ["measured", `${moment(at)} (${at})`],
    ["mode", say("details.mode_of", of)],
    ["status", estimate.status],
    ["reason", estimate.reason],
    ["warnings", warnings.map(warningWords).join("\n")],
    ["features", Object.entries(features).map(([name, value]) => `${name} ${exact(value)}`).join("\n")],
    ["model", `${estimate.model} ${modelOf(estimate)}`],
    ["probe", proberWords(measurement)],
    ["certificate", estimate.calibration_id],
    ["exam", exam ?? ""],
    ["recording", recording],
  ];
}

/** The picture again, for a panel that has no room for it beside the figures (styles/sizes.css). */
function showPictureAgain() {
  const again = byId("image").closest("figure").cloneNode(true);
  for (const one of again.querySelectorAll("[id]")) one.removeAttribute("id");
  byId("details-picture").replaceChildren(...again.childNodes);
}

/** Draw how it was pressed, once the probe has said it; a recording that was deleted has no curve. */
async function showForces({ id }) {
  const place = byId("details-forces");
  place.replaceChildren();
  shownId = id;
  const curve = forceCurve(await fetchForces(id).catch(() => []));
  if (curve && id === shownId) place.replaceChildren(element("figcaption", "", say("details.forces")), curve);
}

/** Open the details of a measurement. */
export function openDetails(measurement) {
  byId("details-heading").textContent = say("details.title", { n: measurement.seq });
  const told = lines(measurement).filter(([, words]) => words);
  byId("details-list").replaceChildren(...told.flatMap(([name, words]) => [
    element("dt", "", say(`details.${name}`)), element("dd", "", words),
  ]));
  const file = fileLink(say("history.recording"), recordingUrl(measurement.id));
  byId("details-file").replaceChildren(file);
  showPictureAgain();
  showForces(measurement);
  dialog.showModal();
}
