"""The fast model is judged without the tracer's noise, and the chapter says when there is no table."""

from __future__ import annotations

from pathlib import Path

import pytest

from host_tools.verification.light.lookup import HeldOutRow, benchmarks, chapter, model_error


def row(rms: float, noise: float, total: float = 0.0) -> HeldOutRow:
    return HeldOutRow("scene", rms, total, 0.0, noise)


def test_noise_is_taken_off_in_quadrature() -> None:
    assert model_error(row(0.05, 0.03)) == pytest.approx(0.04)
    assert model_error(row(0.02, 0.03)) == 0.0


def test_mean_worst_and_sum_each_have_a_bound() -> None:
    good = [row(0.02, 0.0)] * 3
    assert [b.passed for b in benchmarks(good)] == [True, True, True]
    assert [b.passed for b in benchmarks([*good, row(0.055, 0.0)])] == [True, False, True]
    assert [b.passed for b in benchmarks([row(0.035, 0.0)])] == [False, True, True]
    assert [b.passed for b in benchmarks([row(0.01, 0.0, -0.06)])] == [True, True, False]


def test_without_a_table_the_chapter_says_which_command_makes_it(tmp_path: Path) -> None:
    assert "host_tools optics build" in chapter(1000, tmp_path).skipped
