"""Hertz: a rigid paraboloid on a half-space, P = 4/3 E* sqrt(R) delta^1.5 on a circle of radius sqrt(R delta)."""

import pytest

from host_tools.verification import hertz


@pytest.fixture(scope="module")
def found():
    return hertz.measurements()


def test_force_radius_and_peak_pressure_are_hertzs_on_a_half_space(found):
    """By the last two slabs, the second twice as large: 2 b - a has no O(a/L)."""
    benchmarks = hertz.benchmarks(found)
    assert len(benchmarks) == 3
    for benchmark in benchmarks:
        assert benchmark.measured == pytest.approx(1.0, rel=2e-3), benchmark


def test_a_finite_slab_adds_to_the_force_in_proportion_to_its_size(found):
    """The base at a distance L stiffens the half-space by O(a/L): twice the slab, half the excess."""
    *_, small, large = (ratios.force - 1 for ratios in found.values())
    assert small / large == pytest.approx(2.0, rel=0.05)
