"""The table of `make bench`: a bound that is missed shows, and another run stands beside."""

import math

import pytest
from bench_table import Figure, print_table, write_table

FAST = Figure("press", "mode quick", 20.0, bound=25.0, here="6 ms here")
FEW = Figure("camera", "frames delivered of those due", 0.97, "", bound=0.99, at_least=True)


def test_a_missed_bound_is_said_on_its_line_and_a_kept_one_is_not():
    assert FAST.holds
    assert "<= 25" in FAST.as_line()
    assert "MISSED" not in FAST.as_line()
    assert not FEW.holds
    assert ">= 0.99  MISSED" in FEW.as_line()


@pytest.mark.parametrize("at_least", [False, True])
def test_what_is_no_number_keeps_no_bound(at_least):
    assert not Figure("press", "mode quick", math.nan, bound=1.0, at_least=at_least).holds


def test_a_figure_without_a_bound_always_holds():
    assert Figure("press", "frames", 1e9, "").holds


def test_another_run_stands_beside_what_it_had_too(tmp_path, capsys):
    write_table([FAST], tmp_path / "before.json")
    slower = Figure("press", "mode quick", 24.0, bound=25.0)
    assert print_table(iter([slower, FEW]), tmp_path / "before.json") == [slower, FEW]
    lines = [line.strip() for line in capsys.readouterr().out.splitlines() if line]
    assert [lines[0], lines[2]] == ["press", "camera"]
    assert lines[1].endswith("+20%")
    assert lines[3].endswith("MISSED")
