// The self-test's own page: what to run, what the operator has to do for it, and what each check found.

import { button, byId, element, setEnabled, isEnabled, setText } from "../base/dom.js";
import { fetchSelfTest, startSelfTest } from "../base/probe.js";
import { isSaid, say } from "../base/words.js";
import { openService } from "../press/faults.js";
import { checkName, checkRemedy, measuredWords } from "./check_words.js";

const WORST_FIRST = ["failed", "not_tested", "passed"];
const ERASE = "⌫";
const UNDER_WAY = new Set(["waiting", "running"]);
const dialog = byId("self-test");
let summaryShown = "";
let results = [];
let problem = "";

const partName = (part) => (isSaid(`part.${part}`) ? say(`part.${part}`) : part);

function checkItem(result) {
  const { part, verdict, code, cause, remedy } = result;
  const item = element("li", "check");
  item.dataset.verdict = verdict;
  const name = element("p", "check-name");
  const said = element("span", "check-verdict", say(`verdict.${verdict}`));
  name.append(element("strong", "", checkName(result)), element("span", "check-part", partName(part)), said);
  item.append(name, element("p", "check-measured", measuredWords(result)));
  if (remedy) item.append(element("p", "check-remedy", checkRemedy(result)));
  if (verdict === "failed") {
    const words = [code, cause, remedy].filter(Boolean).join(" ");
    item.append(button("button button-quiet check-details", say("details"), () => openService(words)));
  }
  return item;
}

function showResults() {
  const rank = ({ verdict }) => WORST_FIRST.indexOf(verdict);
  byId("self-test-results").replaceChildren(...[...results].sort((a, b) => rank(a) - rank(b)).map(checkItem));
}

/** What came of it: what was not tested is named, for nobody may take it for good. */
function verdictWords() {
  const count = (verdict) => results.filter((one) => one.verdict === verdict).length;
  const [failed, passed, untested] = [count("failed"), count("passed"), count("not_tested")];
  if (failed) return say("self_test.failed", { failed, n: results.length });
  if (!passed) return say("self_test.not_tested");
  if (!untested) return say("self_test.passed_all", { n: passed });
  const left = results.filter(({ verdict }) => verdict === "not_tested").map(checkName);
  return say("self_test.passed_part", { passed, n: results.length, parts: left.join(", ") });
}

function lineWords({ self_test: test, guidance }) {
  if (problem) return problem;
  if (!test) return say("self_test.not_run");
  if (UNDER_WAY.has(test.state)) return say(`guidance.${guidance.code}`);
  return test.state === "failed" ? say("self_test.broken_off") : verdictWords();
}

/** Show a status of the probe: the results are asked for whenever there are more of them. */
export function showSelfTest(status) {
  const test = status.self_test;
  setText(byId("self-test-line"), lineWords(status));
  byId("self-test-badge").hidden = !status.simulated;
  const isOver = test && !UNDER_WAY.has(test.state);
  const isPart = isOver && test.verdict === "passed" && results.some(({ verdict }) => verdict === "not_tested");
  dialog.dataset.verdict = !isOver ? "" : isPart ? "passed_part" : test.verdict;
  setEnabled(byId("self-test-run"), !UNDER_WAY.has(test?.state));
  const summary = JSON.stringify(test);
  if (summary === summaryShown || !dialog.open) return;
  summaryShown = summary;
  results = [];
  if (!test) showResults();
  else takeResults(summary);
}

/** Ask for the results of a summary; once there is a later one, they are not those any more. */
async function takeResults(summary) {
  try {
    const found = await fetchSelfTest();
    if (summary !== summaryShown) return;
    results = found.results;
    showResults();
  } catch {
    if (summary === summaryShown) summaryShown = ""; // asked again with the next status
  }
}

// The probe's panel has no keyboard: its one number is pressed on keys that stand there once its field was chosen.
const weightField = byId("self-test-weight");
const keys = byId("self-test-keys");
for (const key of [..."1234567890.", ERASE]) {
  const node = button("key", key, () => {
    weightField.value = key === ERASE ? weightField.value.slice(0, -1) : weightField.value + key;
  });
  node.setAttribute("aria-label", key === ERASE ? say("keys.erase") : key);
  keys.append(node);
}
keys.addEventListener("mousedown", (event) => event.preventDefault()); // so the field stays chosen
weightField.addEventListener("focus", () => { keys.hidden = false; });
// Not when it loses its focus: then the button below would move away from under the finger that presses it.
dialog.addEventListener("close", () => { keys.hidden = true; });

byId("self-test-open").addEventListener("click", () => { byId("menu").close(); dialog.showModal(); });
byId("self-test-close").addEventListener("click", () => dialog.close());
byId("self-test-form").addEventListener("submit", async (event) => {
  event.preventDefault();
  if (!isEnabled(byId("self-test-run"))) return;
  const weight = weightField.value.replace(",", ".");
  problem = "";
  try {
    await startSelfTest({ on_block: byId("self-test-block").checked, weight_n: weight ? Number(weight) : null });
  } catch (error) {
    problem = error.code === "E803" ? say("self_test.weight_refused") : error.message;
  }
});
