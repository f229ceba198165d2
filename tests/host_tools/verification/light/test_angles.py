"""Critical angles are those of Snell's law, also where nothing is trapped."""

from __future__ import annotations

import math

import pytest

from host_tools.verification.light.angles import chapter, critical_angle_of_interface_deg, lowest_incidence_deg


def test_every_angle_and_reflectance_is_the_one_on_paper() -> None:
    for benchmark in chapter(0).benchmarks:
        assert benchmark.error <= (1e-6 if "(degrees)" in benchmark.quantity else 1e-12), benchmark


def test_an_interface_into_a_medium_as_dense_traps_nothing() -> None:
    assert math.isnan(critical_angle_of_interface_deg(1.40, 1.40))
    assert math.isnan(critical_angle_of_interface_deg(1.39, 1.42))


def test_at_the_default_index_a_sliver_of_a_third_of_a_degree_is_not_trapped() -> None:
    sliver = critical_angle_of_interface_deg(1.41, 1.0) - lowest_incidence_deg(1.41)
    assert sliver == pytest.approx(0.343, abs=0.001)
    assert lowest_incidence_deg(1.43) > critical_angle_of_interface_deg(1.43, 1.0)


def test_the_table_says_what_passes_at_every_angle() -> None:
    (table,) = chapter(0).tables
    row = dict(zip(table.header, table.rows[1], strict=True))
    assert row["block"] == "1.40"
    assert row["skin 1.38"] == "80.3"
    assert row["skin 1.4"] == "all passes"
