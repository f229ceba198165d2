"""One word for one thing: names, prose and the operator's texts keep to docs/glossary.md.

A rule forbids a word in some scopes: `names` of Python code, `prose` (documents, docstrings, comments), and `screen`,
the texts that an operator may read. `where` narrows a rule to some files.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest
from daemon_process import ROOT
from prose import CODE

from device.measurement.mode import MODES

NAMES, PROSE, SCREEN = "names", "prose", "screen"
ALL = (NAMES, PROSE, SCREEN)


class Rule(NamedTuple):
    """A word as a pattern of lower-case words with spaces between, what to say instead, and where it is forbidden."""

    word: str
    say: str
    scopes: tuple[str, ...] = ALL
    where: str = ""


TABLES = r"device/simulation/physics/(slab|inclusion_axes|surface_table|off_axis_table)|/probe_tables/"
TRAINING = r"^host_tools/(press_models|scores)/"
RULES = (
    Rule("lumps?", "inclusion"),
    Rule("tumou?rs?", "inclusion; lesion to the operator"),
    Rule("nodules?", "inclusion; lesion to the operator"),
    Rule("twins?", "nearest inclusion"),
    Rule("peers?", "cross-check, the other program"),
    Rule("contrasts?", "elastic mismatch: contrast is optical", where=TABLES),
    Rule("stiffness contrast", "elastic mismatch"),
    Rule("contrast of stiffness", "elastic mismatch"),
    Rule("pools?", "press set, training set", where=TRAINING),
    Rule("lessons?", "training task"),
    Rule("efforts?", "training budget"),
    Rule("judged", "evaluated", (NAMES,), where=TRAINING),
    Rule("sights?", "observed press", (NAMES,)),
    Rule("ideal picture|light picture", "image model", (NAMES,)),
    Rule("held (model|profile|features|units|names|rows|estimate)", "quick", (NAMES,)),
    Rule("profile model", "ramp model; standard_model in the settings", (NAMES, SCREEN)),
    Rule("held model|profile model", "quick model, ramp model", (PROSE,)),
    Rule("confidence bands?|bands of", "confidence belt", (NAMES, PROSE)),
    Rule("bands", "belts", (NAMES,), where="confidence_belt|press_models|scores"),
    Rule("doubts?( about)?", "out-of-distribution test, rejection"),
    Rule("growth", "reference force response", (NAMES, PROSE), where="ramp_modes|press_models|cramer_rao|paper_mode"),
    Rule("bare", "baseline, inclusion-free", (NAMES,)),
    Rule("to unit|from unit|unknowns from unit|slope of unit|by unit", "normalised", (NAMES,)),
    Rule("--profile", "--mode", (PROSE, SCREEN)),
)
KEPT = {
    "lump_per_n_mm3": "array in the committed tables",
    "lump_change_per_n_mm3": "array in the committed tables",
    "lump_degrees": "array in the committed surrogate",
    "lump_coefficients": "array in the committed surrogate",
    "bare_per_n": "array in the committed tables",
    "bare_change_per_n": "array in the committed tables",
    "bare_degrees": "array in the committed surrogate",
    "bare_coefficients": "array in the committed surrogate",
    "effort": "entry of the committed cards",
    "TSIS_REQUIRE_PEERS": "read by continuous integration",
}
"""Names inside files that others keep, with the reason why they stay."""


class Text(NamedTuple):
    """What is searched: the file it stands in, its scope, and its words in lower case."""

    file: str
    scope: str
    words: str


def python_files() -> list[Path]:
    """Return every module but this one."""
    found = (path for room in ("device", "host_tools", "tests") for path in (ROOT / room).rglob("*.py"))
    return sorted(path for path in found if path != Path(__file__))


def spoken(name: str) -> str:
    """Return an identifier as words: `HeldModel` and `held_model` are both "held model"."""
    parts = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name)
    return " ".join(part.lower() for part in parts.split("_") if part)


def names(tree: ast.AST) -> Iterator[str]:
    """Yield every name that code defines or uses, but for those of `KEPT`."""
    for node in ast.walk(tree):
        for field in ("id", "attr", "name", "arg"):
            if isinstance(name := getattr(node, field, None), str) and name not in KEPT:
                yield name


def docstrings(tree: ast.AST) -> set[ast.Constant]:
    """Return the strings that stand alone: docstrings, and those below constants."""
    alone = [node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)]
    return {value for value in alone if isinstance(value, ast.Constant) and isinstance(value.value, str)}


def comments(source: str) -> Iterator[str]:
    """Yield the comments of a module."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.string


def of_module(path: Path) -> Iterator[Text]:
    """Yield the names and the prose of a module, and of the daemon's the strings, too."""
    file, source = str(path.relative_to(ROOT)), path.read_text(encoding="utf-8")
    tree = ast.parse(source)
    alone = docstrings(tree)
    yield from (Text(file, NAMES, spoken(name)) for name in sorted(set(names(tree))))
    yield from (Text(file, PROSE, plain(str(one.value))) for one in alone)
    yield from (Text(file, PROSE, plain(comment)) for comment in comments(source))
    if file.startswith("device/"):
        strings = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and node not in alone)
        yield from (Text(file, SCREEN, plain(one.value)) for one in strings if isinstance(one.value, str))


def plain(text: str) -> str:
    """Return a text in lower case without code, hyphens and line ends."""
    for name in KEPT:
        text = re.sub(rf"\b{name}\b", "", text)
    return " ".join(CODE.sub(" ", text).replace("-", " ").lower().split())


@cache
def texts() -> tuple[Text, ...]:
    """Return all that is searched."""
    found = [text for path in python_files() for text in of_module(path)]
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")]
    for page in pages:
        if page.name != "glossary.md":
            found.append(Text(str(page.relative_to(ROOT)), PROSE, plain(page.read_text(encoding="utf-8"))))
    for page in filter(Path.is_file, (ROOT / "device" / "web" / "static").rglob("*")):
        found.append(Text(str(page.relative_to(ROOT)), SCREEN, plain(page.read_text(encoding="utf-8"))))
    return tuple(found)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.word)
def test_a_word_is_not_used_for_what_another_one_says(rule: Rule) -> None:
    pattern, where = re.compile(rf"\b(?:{rule.word})\b"), re.compile(rule.where)
    found = {
        f"{text.file} ({text.scope}): {text.words[max(0, hit.start() - 40) : hit.end() + 40]}"
        for text in texts()
        if text.scope in rule.scopes and where.search(text.file) and (hit := pattern.search(text.words))
    }
    assert not found, f"say {rule.say}: " + "; ".join(sorted(found))


def test_every_word_that_is_not_said_stands_in_the_glossary() -> None:
    glossary = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8").lower()
    missing = [rule.word for rule in RULES if not re.search(rule.word, glossary)]
    assert missing == []


def test_every_name_that_the_glossary_says_is_one_of_the_codes() -> None:
    known = {text.words for text in texts() if text.scope == NAMES}
    said = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8").split("## Names that stay")[0]
    rows = [line.split("|")[2] for line in said.splitlines() if line.startswith("| ")]
    named = {name for row in rows for name in re.findall(r"`([A-Za-z_]+)`", row)} - set(MODES)
    assert len(named) > 20
    assert {name for name in named if spoken(name) not in known} == set()


def test_names_in_capitals_and_snakes_are_the_same_words() -> None:
    assert spoken("HeldModel") == spoken("held_model") == spoken("HELD_MODEL") == "held model"
    assert spoken("PCA9685Chip") == "pca9685 chip"
