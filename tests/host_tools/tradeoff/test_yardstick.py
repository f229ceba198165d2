"""Costs are ratios of processor times to the yardstick of the same run."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from host_tools.tradeoff import yardstick
from host_tools.tradeoff.yardstick import cost, exp_and_sum, processor_s, subprocess_s, timed


def test_the_yardstick_is_the_sum_of_the_exponential_of_one_image() -> None:
    """The mean of exp over even numbers from 0 to 1 is e - 1."""
    assert exp_and_sum() / (492 * 768) == pytest.approx(np.e - 1, rel=1e-3)


def test_a_cost_is_the_ratio_of_the_least_times_taken_in_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that each call of the yardstick moves by 1 s, and each call of the work by some 20 s after the first."""
    now = [0.0]
    work_s = iter([10.0, 20.0, 15.0, 18.0])

    def moves(seconds: float) -> None:
        now[0] += seconds

    monkeypatch.setattr(yardstick, "LONG_S", 1e9)
    monkeypatch.setattr(yardstick, "exp_and_sum", lambda: moves(1.0))
    monkeypatch.setattr(yardstick, "processor_s", lambda: now[0])
    found = cost(lambda: moves(next(work_s)), 3)
    assert found == (15.0, 15.0)


def test_work_that_takes_long_is_done_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yardstick, "LONG_S", 0.0)
    calls: list[float] = []
    cost(lambda: calls.append(exp_and_sum()))
    assert len(calls) == 1


def test_the_time_of_a_finished_subprocess_counts() -> None:
    before, before_children = processor_s(), subprocess_s()
    subprocess.run([sys.executable, "-c", "sum(range(3_000_000))"], check=True)
    spent = subprocess_s() - before_children
    assert spent > 0
    assert processor_s() - before >= spent


def test_what_is_timed_gives_its_result() -> None:
    result, found = timed(lambda: sum(range(100_000)))
    assert result == 4_999_950_000
    assert found.yardsticks > 0
