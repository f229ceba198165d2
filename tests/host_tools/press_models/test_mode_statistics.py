"""Errors, skill, coverage and octiles of answers whose statistics are known on paper."""

import numpy as np
import pytest

from device.measurement.confidence_belt import Belt
from device.measurement.parameters import EVEN_STD, RANGES
from device.measurement.quantities import UNKNOWNS
from host_tools.press_models.mode_outcome import EvaluatedPresses
from host_tools.press_models.mode_statistics import OCTILES, octile_of, statistics

COUNT = 4000
ENDS, NONE = np.array([-1.0, 1.0]), np.zeros((2, 2))
BELTS = (Belt(ENDS, np.log([0.01, 1.0]), NONE - 2, NONE + 2),) * 3
"""Two spreads on either side of the mean."""
EVEN = np.tile((2 * np.arange(COUNT) + 1)[:, None] / COUNT - 1, 3)


def of(mean, spread=0.1, truth=EVEN):
    mean, spread = (np.broadcast_to(part, truth.shape) for part in (mean, spread))
    return statistics(EvaluatedPresses(truth, np.array(mean), np.array(spread)), BELTS)


def test_a_perfect_answer_has_skill_1_and_no_error():
    found = of(EVEN)
    assert found["presses"] == COUNT
    for name in UNKNOWNS:
        one = found[name]
        assert (one["skill"], one["determined"], one["coverage"]) == (1, 1, 1)
        assert one["max_percent"] == one["min_percent"] == one["sd_percent"] == 0
        assert one["rms_coordinate_per_octile"] == [0] * OCTILES


def test_a_guess_in_the_middle_has_skill_0():
    assert [of(0.0)[name]["skill"] for name in UNKNOWNS] == pytest.approx([0.0] * 3, abs=1e-3)


def test_an_answer_off_by_half_the_priors_deviation_has_skill_one_half():
    assert of(EVEN + 0.5 * EVEN_STD)["depth_mm"]["skill"] == pytest.approx(0.5)


def test_errors_are_percent_of_the_truth_without_their_sign():
    """Depth d is even from 4 to 12 mm and answered 1 mm off either way: the mean of 1 / d is ln(3) / 8, of its square
    1 / 48."""
    sign = np.where(np.arange(COUNT) % 2, 1, -1)[:, None]
    found = of(EVEN + 0.25 * sign)["depth_mm"]
    mean = np.log(3) / 8
    assert found["mean_percent"] == pytest.approx(100 * mean, rel=1e-3)
    assert found["sd_percent"] == pytest.approx(100 * np.sqrt(1 / 48 - mean**2), rel=2e-3)
    assert (found["min_percent"], found["max_percent"]) == pytest.approx((100 / 12, 25.0), rel=1e-3)


def test_coverage_counts_presses_that_determine_the_unknown_alone():
    """Half of them do not and hold the whole range; of the others a quarter lies three spreads aside."""
    number = np.arange(COUNT)
    spread = np.where(number % 2, 0.1, 0.6 * EVEN_STD)[:, None]
    aside = np.where(number % 8 == 1, 0.3, 0.0)[:, None]
    found = of(EVEN + aside, spread)["size_mm"]
    assert found["determined"] == 0.5
    assert found["coverage"] == pytest.approx(0.75, abs=0.02)  # a mean beyond the range is brought to its end
    assert found["coverage_per_octile"][:-1] == pytest.approx([0.75] * (OCTILES - 1), abs=0.02)


def test_where_nothing_is_determined_there_is_no_coverage():
    found = of(EVEN, 0.6 * EVEN_STD)["size_mm"]
    assert found["determined"] == 0
    assert found["coverage"] is None
    assert found["coverage_per_octile"] == [None] * OCTILES


def test_octiles_split_the_truth_into_eight_equal_parts_and_know_their_own_errors():
    """Size from 2 to 15 mm, errors in the last octile alone."""
    last = np.where(EVEN > 0.75, 0.1, 0.0)
    found = of(EVEN - last)["size_mm"]
    low, high = RANGES["size_mm"].low, RANGES["size_mm"].high
    assert found["octile_ends"] == pytest.approx(list(np.linspace(low, high, OCTILES + 1)), abs=0.01)
    assert found["rms_coordinate_per_octile"] == pytest.approx([0.0] * 7 + [0.1], abs=1e-6)
    assert found["mean_percent_per_octile"][:7] == [0] * 7
    assert found["mean_percent_per_octile"][7] == pytest.approx(100 * 0.65 / 14.2, rel=0.01)


def test_every_octile_holds_as_many_truths_and_the_largest_is_in_the_last():
    octile = octile_of(np.random.default_rng(1).permutation(800.0 + np.arange(800)))
    np.testing.assert_array_equal(np.bincount(octile), [100] * OCTILES)
    np.testing.assert_array_equal(octile_of(np.arange(9.0)), [0, 1, 2, 3, 4, 5, 6, 7, 7])


def test_numbers_are_rounded_to_four_digits():
    assert of(EVEN + EVEN_STD * 0.123456)["size_mm"]["skill"] == 0.8765
