"""How alike inclusions outside and inside the ranges look: by the normal law, and a press that is its own nearest."""

from pathlib import Path

import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.fit import PressPosterior
from host_tools.press_models.press_samples import profile_rows
from host_tools.scores.just_outside import (
    FALSE_FLAGS,
    INCLUSIONS,
    NearestInside,
    _benchmarks,
    _row,
    at_nominal,
    holds,
    inclusion_ramps,
    nearest_inside,
)
from host_tools.scores.outside import FALSE_AT_MOST

MODELS = Path(__file__).parents[3] / "models"
INSIDE = Inclusion(9.0, 5.0, 60.0)


@pytest.mark.parametrize(("deviations", "share"), [(0.0, 0.05), (1.6449, 0.5), (3.2897, 0.95)])
def test_the_best_test_flags_as_the_normal_law_says(deviations, share):
    assert NearestInside(INSIDE, deviations).most_flagged(0.05) == pytest.approx(share, abs=1e-4)


def test_one_of_four_tests_has_less_than_a_fourth_of_the_false_flags():
    """1 % of the presses inside: a test that flags half of what is 2.33 deviations apart."""
    assert 4 * FALSE_FLAGS < FALSE_AT_MOST
    assert NearestInside(INSIDE, 2.3263).most_flagged() == pytest.approx(0.5, abs=1e-4)


def test_an_inclusion_inside_is_its_own_nearest(tables):
    answers = read_ramp_model(MODELS / "standard").answers
    row = profile_rows(tables, at_nominal(INSIDE)[None])[0]
    posterior = PressPosterior(row, answers.surrogate, answers.noise, direction_rad=np.zeros(1))
    nearest = nearest_inside(posterior, seed=0)
    assert nearest.deviations < 1.5
    assert (nearest.inclusion.size_mm, nearest.inclusion.depth_mm) == pytest.approx((9.0, 5.0), rel=0.02)


def test_the_ramp_of_an_inclusion_inside_is_the_tables_own(tables):
    ours, own = inclusion_ramps(tables, INSIDE), tables.centred.ramps(INSIDE)
    assert np.array_equal(ours.inclusion_field.fields_per_n, own.inclusion_field.fields_per_n)


def test_every_inclusion_is_outside_in_just_one_unknown():
    low, high = np.array([2.0, 4.0, 10.0]), np.array([15.0, 12.0, 160.0])
    values = np.array([inclusion.as_tuple() for inclusion in INCLUSIONS])
    assert ((values < low) | (values > high)).sum(axis=1).tolist() == [1] * len(INCLUSIONS)


def quantity(low, high, *, low_is_open=False, high_is_open=False):
    return Quantity((low + high) / 2, low, high, 1.0, True, low_is_open, high_is_open)


def estimate(*answers):
    return Estimate(*answers, "ok", "", "standard", "m", "0", "c", True, features={})


@pytest.mark.parametrize(
    ("answer", "truth", "held"),
    [
        (quantity(10.0, 12.0), 13.0, False),
        (quantity(10.0, 12.0, high_is_open=True), 13.0, True),
        (quantity(10.0, 12.0, high_is_open=True), 9.0, False),
        (quantity(4.0, 5.0, low_is_open=True), 3.6, True),
    ],
)
def test_an_open_end_holds_all_beyond_it(answer, truth, held):
    assert holds(answer, truth) is held


def test_a_refusal_is_asked_for_only_where_a_test_could_tell():
    """16 mm, 6 mm deep, 60 kPa: one answer holds size and modulus and misses the depth, the other is a refusal."""
    large = quantity(14.0, 15.0, high_is_open=True)
    found = [estimate(large, quantity(6.5, 8.0), quantity(20.0, 90.0)), estimate(*[UNKNOWN_QUANTITY] * 3)]
    for too_alike in (3.0, 3.7):
        assert _benchmarks(INCLUSIONS[0], NearestInside(INSIDE, too_alike), found) == []
    [benchmark] = _benchmarks(INCLUSIONS[0], NearestInside(INSIDE, 4.0), found)
    assert benchmark.measured == 0.5
    assert not benchmark.passed
    assert _row(INCLUSIONS[0], NearestInside(INSIDE, 4.0), found)[8:] == (
        "95%",
        "99%",
        "50%",
        "100%",
        "0%",
        "100%",
    )
