"""Relative errors and their totals against numbers worked out by hand."""

from __future__ import annotations

import io

import numpy as np
import pytest
from rich.console import Console

from device.measurement.quantities import InvalidQuantity
from host_tools.paper_network.evaluate import ErrorTable, relative_errors, render

TRUTH = np.array([[10.0, 5.0, 100.0], [10.0, 5.0, 100.0]])
ESTIMATE = np.array([[11.0, 5.0, 60.0], [8.0, 4.0, 100.0]])


def test_relative_errors_are_unsigned_shares_of_the_truth() -> None:
    """|11-10|/10, |5-5|/5, |60-100|/100; |8-10|/10, |4-5|/5, 0."""
    assert relative_errors(TRUTH, ESTIMATE) == pytest.approx(np.array([[0.1, 0.0, 0.4], [0.2, 0.2, 0.0]]))


def test_a_vanishing_truth_has_no_relative_error() -> None:
    with pytest.raises(InvalidQuantity, match=r"size_mm of row 1 is 0\.0, but must be above 0"):
        relative_errors(np.array([[1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]), np.ones((2, 3)))


def test_totals_are_in_percent_with_the_sample_standard_deviation() -> None:
    """Size errors 10 and 20 %: mean 15, sample SD sqrt(5^2 + 5^2) = 7.071, min 10, max 20."""
    totals = ErrorTable(TRUTH, ESTIMATE).totals()
    assert [totals[name][0] for name in ("mean", "SD", "min", "max")] == pytest.approx([15.0, 50**0.5, 10.0, 20.0])


def test_the_table_prints_our_figures_beside_the_papers() -> None:
    console = Console(file=io.StringIO(), width=140)
    console.print(render(ErrorTable(TRUTH, ESTIMATE)))
    printed = console.file.getvalue()  # type: ignore[attr-defined]
    assert "60.00 for 100.00 kPa: 40.0 %" in printed
    assert "15.00 % (6.98 %)" in printed
    assert "20.00 % (11.72 %)" not in printed
    assert "40.00 % (11.72 %)" in printed
