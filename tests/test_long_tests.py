"""The list of long tests names tests that are there, and a report of a run adds to it what took long."""

from __future__ import annotations

import ast
from pathlib import Path

import long_tests
import pytest
from long_tests import KEPT, LONGEST_S, ROOT, is_listed, listed, long_ones, measured


def functions_of(path: str) -> set[str]:
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("name", sorted({one.split("[")[0] for one in listed()} | set(KEPT)))
def test_what_is_named_is_there(name: str) -> None:
    path, *within = name.split("::")
    assert (ROOT / path).is_file()
    assert not any(within) or within[-1] in functions_of(path)


def test_what_is_kept_is_not_listed() -> None:
    assert not [name for name in listed() if name.startswith(KEPT)]


def test_a_report_tells_the_long_ones_and_a_function_of_long_ones_stands_there_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    report = tmp_path / "tests.xml"
    case = '<testcase classname="tests.room.test_room{}" name="{}" time="{}"/>'
    cases = [("", "test_a", 0.1), ("", "test_b", 9), ("", "test_c[1]", 0.1), ("", "test_c[2]", 9),
             (".TestClass", "test_d[1]", 9), (".TestClass", "test_d[2]", 9)]  # fmt: skip
    report.write_text(f"<testsuites><testsuite>{''.join(case.format(*one) for one in cases)}</testsuite></testsuites>")
    room = "tests/room/test_room.py"
    assert LONGEST_S < 9
    long = {f"{room}::test_b", f"{room}::test_c[2]", f"{room}::TestClass::test_d"}
    assert set(long_ones(measured(report))) == long
    monkeypatch.setattr(long_tests, "LIST", tmp_path / "list.txt")
    long_tests.LIST.write_text(f"{room}::test_before\n")
    long_tests.main([str(report)])
    names = listed()
    assert is_listed(f"{room}::test_a", frozenset({room}))
    assert names == long | {f"{room}::test_before"}
    assert is_listed(f"{room}::TestClass::test_d[1]", names)
    assert is_listed(f"{room}::test_c[2]", names)
    assert not is_listed(f"{room}::test_c[1]", names)
