"""The threat model names a test for each requirement, and each of them exists."""

import ast
import re
from functools import cache

import pytest
from daemon_process import ROOT

PAGE = (ROOT / "docs" / "threat_model.md").read_text(encoding="utf-8")
ROWS = re.findall(r"^\| (\d+) \| (.+?) \| (.+?) \|$", PAGE, re.MULTILINE)
NAMED = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")


@cache
def functions_of(file):
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_it_has_a_row_for_each_of_the_list_and_those_that_were_added():
    assert [int(number) for number, _, _ in ROWS] == list(range(1, 38))


@pytest.mark.parametrize(("number", "requirement", "shown"), ROWS, ids=[row[0] for row in ROWS])
def test_every_row_names_tests_that_exist_or_says_that_it_is_open(number, requirement, shown):
    named = NAMED.findall(shown)
    assert bool(named) != shown.startswith("open: ")
    for file, name in named:
        assert name in functions_of(file), f"{file} has no {name}"


def test_every_row_that_a_data_flow_refers_to_is_there():
    flows = PAGE.partition("## Data flows")[2].partition("## What is shown")[0]
    named = {int(number) for found in re.findall(r"\(([\d, ]+)\)", flows) for number in found.split(",")}
    assert named <= {int(number) for number, _, _ in ROWS}
    assert len(named) > 10
