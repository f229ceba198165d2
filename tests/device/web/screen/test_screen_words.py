"""The screen's words: whole in each language, for every fault and every sentence that the daemon can say."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from daemon_process import ROOT

from device.config import PressSection
from device.fault_table import FAULTS
from device.instrument.press.machine import FrameSeen, PressRules, PressUnderWay
from device.instrument.press.states import CANCELLED, Guidance, PressState, never_lifted, off_centre, too_hard
from device.measurement.estimate import NO_NUMBERS, NOT_ROUND, NOTHING_STANDS_OUT, SHADE, UNKNOWN_IMAGE
from device.measurement.mode import MODES
from device.measurement.quantities import Bound
from device.measurement.quick_mode.model import TISSUE_TAKEN
from device.measurement.ramp_modes.estimate import AWAY_FROM_BONE, CAUSES, REASONS
from device.web.screen.screen_words import LANGUAGES, page, words_of

STATIC = ROOT / "device" / "web" / "static"
ENGLISH = words_of("en")
REMEDIES = {key: text for key, text in words_of("sentences").items() if key.startswith("remedy.")}
KEPT = {key: text for key, text in words_of("sentences").items() if key.startswith("kept.")}
SENTENCES = {key: text for key, text in words_of("sentences").items() if key not in REMEDIES | KEPT}
ELSEWHERE = {
    "daemon_stopped",
    "daemon_restarted",
    "force_below",
    "force_other",
    "not_round",
    "unlike_image",
    "no_numbers",
    "wipe_press_beside",
    "tare_wipe",
    "press_straight",
    "turn_probe",
    "away_from_bone",
    "nothing_stood_out",
    "tissue_alone",
    "tissue_taken",
}
"""Said where a whole daemon or a recording is needed, or never alone, or in measurements of before."""
SAID_BY_FAULTS = {"is", "do"}


def placeholders(text: str) -> set[str]:
    return set(re.findall(r"\{(\w+)\}", text))


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_language_says_everything_with_the_same_figures(language: str) -> None:
    words = words_of(language)
    assert list(words) == list(ENGLISH)
    assert {key for key in words if placeholders(words[key]) != placeholders(ENGLISH[key])} == set()
    silent = {key for key, text in words.items() if not text}
    assert all(re.fullmatch(r"reason\.\w+\.do", key) for key in silent)


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_fault_is_said_in_words_of_the_operator(language: str) -> None:
    words = words_of(language)
    wanted = {f"fault.{fault.code}.{part}" for fault in FAULTS for part in SAID_BY_FAULTS}
    assert wanted <= words.keys()
    for key in wanted:
        assert not re.search(r"/dev|errno|register|I2C|daemon|0x", words[key], re.IGNORECASE), key


def test_every_state_that_the_daemon_tells_has_words() -> None:
    wanted = {f"guidance.{one.code}" for one in Guidance} | {f"mode.{mode}" for mode in MODES}
    quiet = {PressState.IDLE, PressState.DONE, PressState.REJECTED}
    wanted |= {f"state.{state.code}" for state in PressState if state not in quiet}
    assert wanted <= ENGLISH.keys()


def scripts() -> list[Path]:
    return [path for path in STATIC.rglob("*") if path.suffix in (".js", ".html")]


@pytest.mark.parametrize("path", scripts(), ids=lambda path: path.name)
def test_what_the_page_asks_for_is_there(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    asked = set(re.findall(r'say\("([^"]+)"', text)) | set(re.findall(r'data-say(?:-label|-title)?="([^"]+)"', text))
    assert asked <= ENGLISH.keys()


def test_nothing_is_there_that_no_page_says() -> None:
    """A key stands in a script as it is, or begins with what comes before a template's first hole, or is elsewhere."""
    texts = [path.read_text(encoding="utf-8") for path in scripts()]
    literal = {word for text in texts for word in re.findall(r"[\"'`]([\w.]+)[\"'`]", text)}
    begun = {word for text in texts for word in re.findall(r"`([a-z_.]+\.)(?=\$\{)", text)}
    elsewhere = ("remedy.", "fallback.")
    assert {key for key in ENGLISH if key not in literal and not key.startswith((*begun, *elsewhere))} == set()


def daemon_sentences() -> list[str]:
    """Return every reason that a press or an estimate is answered with, made by the code that says it."""
    press = PressSection()
    spots = [(3.0, 0.1), (-3.0, 0.2), (2.5, 2.5), (0.1, -3.0)]
    by_code = [too_hard(1.204, 1.0), CANCELLED, *(off_centre(spot, 2.5) for spot in spots)]
    started = PressUnderWay().begin("press", 0.0)
    rules = PressRules.of(press, press.band_n, is_ramp=False)
    held = replace(started, state=PressState.HOLDING, saturated=99, replaced=99, touched_s=0.0, lifts=99, peak_n=0.4)
    late_s = 2 * rules.timeout_s
    for state, force_n, range_n in (
        (PressState.TOO_LIGHT, 0.3, 0.0),
        (PressState.TOO_HARD, 0.8, 0.0),
        (PressState.HOLDING, 0.5, 1.0),
        (PressState.HOLDING, 0.5, 0.0),
    ):
        seen = FrameSeen(late_s, force_n, force_n, range_n, 0.0)
        by_code.append(replace(held, state=state).see(seen, rules).reason)
    lifted = FrameSeen(1.0, 0.0, 0.0, 0.0, 0.0)
    by_code.append(held.see(lifted, rules).reason)
    by_code.append(started.see(replace(lifted, t_s=late_s), rules).reason)
    by_code.append(held.check(lifted, press).reason)
    by_code.append(never_lifted(press.timeout_s))
    by_code.append(replace(held, state=PressState.RELEASING).wait(late_s, 1.0, press).reason)
    by_code.append(held.replace_frame(0.123).reason)
    by_code.append(held.see(FrameSeen(1.0, 0.5, 0.5, 0.0, 0.0, 0.012), rules).reason)
    estimates = [NOTHING_STANDS_OUT, *(f"{one} {NO_NUMBERS}" for one in (*REASONS.values(), NOT_ROUND, UNKNOWN_IMAGE))]
    estimates.append(" ".join([*REASONS.values(), NO_NUMBERS]))
    estimates += [f"{cause.sentence} {NOT_ROUND} {cause.action}" for cause in CAUSES.values()]
    estimates.append(f"The image is too bright: 1.2% of its pixels are saturated, above 0.1%. {SHADE}")
    estimates.append(f"{REASONS['tissue_from_middle_ratio']} {AWAY_FROM_BONE}")
    estimates.append(f"This press does not determine size and depth and Young's modulus. {TISSUE_TAKEN}")
    return by_code + estimates


def pattern_of(sentence: str) -> str:
    return re.sub(r"\\\{\w+\\\}", ".+?", re.escape(sentence))


def is_understood(text: str) -> bool:
    """Whether sentences after each other make the text, as static/base/words.js reads it."""
    patterns = [pattern_of(one) for one in SENTENCES.values()]
    while text:
        hit = next(filter(None, (re.match(f"{pattern}(?=\\s|$)", text) for pattern in patterns)), None)
        if not hit:
            return False
        text = text[hit.end() :].strip()
    return True


@pytest.mark.parametrize("text", daemon_sentences())
def test_a_reason_of_the_daemon_is_said_in_the_operators_words(text: str) -> None:
    assert is_understood(text)


def test_every_sentence_of_the_daemon_has_its_words_and_is_said() -> None:
    wanted = {f"reason.{key}.{part}" for key in SENTENCES for part in ("do", "why")}
    assert wanted <= ENGLISH.keys()
    made = daemon_sentences()
    unheard = {key for key, text in SENTENCES.items() if not any(re.match(pattern_of(text), one) for one in made)}
    assert unheard <= ELSEWHERE


def test_a_reason_that_is_kept_has_its_words_in_each_language() -> None:
    said = {key.replace("kept.", "void.") for key in KEPT} - {"void.filed"}  # that one is read in the audit alone
    assert said == {key for key in ENGLISH if key in said}
    assert {ENGLISH[key] for key in said} <= set(KEPT.values())


SELF_TEST = ROOT / "device" / "instrument" / "self_test"
NAMED_BY = {"compared": 1, "not_tested": 1, "CheckResult": 1, "broken": 0}
"""The calls that name a check, and which of their arguments does."""


def modules_of_the_self_test() -> list[ast.Module]:
    return [ast.parse((SELF_TEST / name).read_text(encoding="utf-8")) for name in ("checks.py", "run.py")]


def literals(tree: ast.AST) -> Iterator[str]:
    """Every text of a module but its docstrings; of an f-string what is between its values, which are "1"."""
    parts = {part for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in node.values}
    alone = {node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield "".join(part.value if isinstance(part, ast.Constant) else "1" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in parts | alone:
            yield node.value


def names_of_checks() -> set[str]:
    """Every check's name, as it is written: those of a call, of the table of all checks, and of a variable `check`."""
    found = set()
    for tree in modules_of_the_self_test():
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in NAMED_BY:
                named: list[ast.expr | None] = [node.args[NAMED_BY[node.func.id]]]
            elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "check":
                named = [node.value]
            elif isinstance(node, ast.AnnAssign) and isinstance(node.value, ast.Dict):
                named = node.value.keys
            else:
                continue
            found |= {one.value for one in named if isinstance(one, ast.Constant)}
            found |= {ast.unparse(one) for one in named if isinstance(one, ast.JoinedStr)}
    return found


MADE_OF = {"f'model {name}'": "check.model", "f'LED {side}'": "check.LED", "f'LED {SIDES[number]}'": "check.LED"}
MADE_OF["f'date after {NOT_BEFORE:%Y-%m-%d}'"] = "check.date"


def test_every_check_of_the_self_test_has_a_name_in_each_language() -> None:
    names = names_of_checks()
    assert {"noise", "enable line", "LED sides", "write and read", "f'model {name}'"} <= names
    assert {MADE_OF.get(name, f"check.{name}") for name in names} <= ENGLISH.keys()


def test_every_remedy_of_the_self_test_is_said_in_the_operators_words() -> None:
    sentences = {text for tree in modules_of_the_self_test() for text in literals(tree) if text.endswith(".")}
    assert "Repeat it with a known weight." in sentences
    said = {one: [key for key, text in REMEDIES.items() if re.fullmatch(pattern_of(text), one)] for one in sentences}
    assert {one for one, keys in said.items() if not keys} == set()
    assert {key for keys in said.values() for key in keys} == REMEDIES.keys()
    assert REMEDIES.keys() <= ENGLISH.keys()


def test_every_unit_and_bound_of_the_self_test_has_words() -> None:
    calls = [node for tree in modules_of_the_self_test() for node in ast.walk(tree) if isinstance(node, ast.Call)]
    units = {ast.literal_eval(one.args[2]) for one in calls if ast.unparse(one.func) == "Bound"}
    assert {"counts", "days", "bytes wrong"} <= units
    assert {f"unit.{one}" for one in units - {"N", "s", "MB"}} <= ENGLISH.keys()
    bounds = [Bound(1, 2, ""), Bound(1, 2, "", low_included=False, high_included=False)]
    words = {word for one in bounds for word in re.findall(r"at least|above|at most|below", str(one))}
    assert {f"bound.{word}" for word in words} <= ENGLISH.keys()
    assert len(words) == 4


def test_the_page_of_all_sentences_is_the_files() -> None:
    shown = (ROOT / "docs" / "screen_words.md").read_text(encoding="utf-8")
    assert shown == page(), "python -m device.web.screen.screen_words > docs/screen_words.md"
