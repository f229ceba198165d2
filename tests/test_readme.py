"""README, results and the page of a probe of one's own are executed.

Their commands exist, and what a page prints of them is what they print.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest
from daemon_process import ROOT

PAGES = ("README.md", "docs/results.md", "docs/own_probe.md")
TEXTS = {page: (ROOT / page).read_text(encoding="utf-8") for page in PAGES}
BLOCKS = [block for text in TEXTS.values() for block in re.findall(r"```console\n\$ (.*)\n((?:.*\n)*?)```", text)]
PYTHON_BLOCKS = re.findall(r"```python\n((?:.*\n)*?)```", TEXTS["README.md"])
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")


SMALLEST_PERCENT = 0.5
"""The smallest of ninety errors is what an estimate moves by, and those of E move by some tenths of a per cent."""


def numbers(text):
    return [float(one) for one in NUMBER.findall(text)]


def _scores(command):
    return command.startswith("host_tools evaluate")


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        pytest.param(*block, marks=[pytest.mark.long, pytest.mark.study] if _scores(block[0]) else [], id=block[0][:40])
        for block in BLOCKS
        if block[0].startswith("host_tools")
    ],
)
def test_a_command_prints_what_the_page_shows(command, shown):
    """Word for word, numbers within 6 %: another processor rounds differently, and E amplifies it.

    By OPENBLAS_CORETYPE (Haswell, SkylakeX, Zen) means move by 2 %, the largest of ninety errors by 5 %.

    A last line of dots stands for all that is printed behind it.
    """
    arguments = [sys.executable, "-m", *command.split()]
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, timeout=1200)
    assert done.returncode == 0, done.stderr
    expected = shown.removesuffix("...\n").split()
    printed = done.stdout.split()[: len(expected) if shown.endswith("...\n") else None]
    assert [NUMBER.sub("#", word) for word in printed] == [NUMBER.sub("#", word) for word in expected]
    for line, said in zip(shown.removesuffix("...\n").splitlines(), done.stdout.splitlines(), strict=False):
        absolute = SMALLEST_PERCENT if "smallest error" in line else 0.06
        assert numbers(said) == pytest.approx(numbers(line), rel=0.06, abs=absolute), line


def test_every_make_verb_of_the_readme_exists():
    verbs = set(re.findall(r"(?:`|\$ )make ([a-z]+)", TEXTS["README.md"]))
    known = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {"run", "test", "train"} <= verbs <= known


def test_the_greeting_of_make_run_is_the_daemons(daemon):
    shown = next(text for command, text in BLOCKS if command == "make run")
    greeting = r"TSIS simulated probe SIM-0001: screen and API at http://127\.0\.0\.1:\d+/\n"
    assert re.fullmatch(greeting, shown)
    assert re.fullmatch(greeting, daemon.greeting)


@pytest.mark.parametrize("block", PYTHON_BLOCKS)
def test_a_python_example_of_the_readme_runs(block, tmp_path):
    """In a process of its own and an empty folder, without a screen, as a stranger would paste it."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    command = [sys.executable, "-W", "error::DeprecationWarning:__main__", "-c", block]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    for name in re.findall(r'savefig\("([^"]+)"\)', block):
        assert (tmp_path / name).stat().st_size > 10_000


def test_the_scene_that_the_readme_solves_takes_five_lines():
    lines = [line for line in PYTHON_BLOCKS[0].splitlines() if line]
    assert lines[0] == "import host_tools as tsis"
    assert len(lines) <= 5
