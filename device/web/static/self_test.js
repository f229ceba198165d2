// The self-test's own page: what to run, what the operator has to do for it, and what each check found.

import { byId, element, setText } from "./dom.js";
import { fetchSelfTest, startSelfTest } from "./probe.js";

const VERDICTS = { passed: "passed", failed: "failed", not_tested: "not tested" };
const WORST_FIRST = ["failed", "not_tested", "passed"];
const ERASE = "⌫";
const UNDER_WAY = new Set(["waiting", "running"]);
const dialog = byId("self-test");
let summaryShown = "";
let problem = "";

function measuredWords({ value, unit, bound }) {
  if (value === null) return "";
  return `${Number(value.toPrecision(3))} ${unit}, must be ${bound}`;
}

function checkItem(result) {
  const { part, check, verdict, code, cause, remedy } = result;
  const item = element("li", "check");
  item.dataset.verdict = verdict;
  const name = element("p", "check-name");
  name.append(element("strong", "", check), element("span", "check-part", part), element("span", "check-verdict", VERDICTS[verdict]));
  item.append(name, element("p", "check-measured", measuredWords(result)));
  if (remedy) item.append(element("p", "check-remedy", [code, cause, remedy].filter(Boolean).join(" ")));
  return item;
}

function showResults(results) {
  const rank = ({ verdict }) => WORST_FIRST.indexOf(verdict);
  byId("self-test-results").replaceChildren(...[...results].sort((a, b) => rank(a) - rank(b)).map(checkItem));
}

function lineWords({ self_test: test, guidance }) {
  if (problem) return problem;
  if (!test) return "Not run since the probe was started.";
  if (UNDER_WAY.has(test.state)) return guidance.text;
  return test.state === "failed" ? "It was not brought to its end." : `The probe has ${VERDICTS[test.verdict]}.`;
}

/** Show a status of the probe: the results are asked for whenever there are more of them. */
export function showSelfTest(status) {
  const test = status.self_test;
  setText(byId("self-test-line"), lineWords(status));
  byId("self-test-badge").hidden = !status.simulated;
  dialog.dataset.verdict = test && !UNDER_WAY.has(test.state) ? test.verdict : "";
  byId("self-test-run").disabled = UNDER_WAY.has(test?.state);
  const summary = JSON.stringify(test);
  if (summary === summaryShown || !dialog.open) return;
  summaryShown = summary;
  if (!test) showResults([]);
  else fetchSelfTest().then(({ results }) => showResults(results), () => { summaryShown = ""; });
}

// The probe's panel has no keyboard: its one number is pressed on keys that stand there once its field was chosen.
const weightField = byId("self-test-weight");
const keys = byId("self-test-keys");
for (const key of [..."1234567890.", ERASE]) {
  const button = element("button", "key", key);
  button.type = "button";
  button.setAttribute("aria-label", key === ERASE ? "Erase" : key);
  button.addEventListener("click", () => {
    weightField.value = key === ERASE ? weightField.value.slice(0, -1) : weightField.value + key;
  });
  keys.append(button);
}
keys.addEventListener("mousedown", (event) => event.preventDefault()); // so the field stays chosen
weightField.addEventListener("focus", () => { keys.hidden = false; });
// Not when it loses its focus: then the button below would move away from under the finger that presses it.
dialog.addEventListener("close", () => { keys.hidden = true; });

byId("self-test-open").addEventListener("click", () => dialog.showModal());
byId("self-test-close").addEventListener("click", () => dialog.close());
byId("self-test-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  const weight = weightField.value.replace(",", ".");
  problem = "";
  try {
    await startSelfTest({ on_block: byId("self-test-block").checked, weight_n: weight ? Number(weight) : null });
  } catch (error) {
    problem = error.message;
  }
});
