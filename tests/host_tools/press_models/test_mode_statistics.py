"""Errors, skill, coverage and octiles of answers whose statistics are known on paper."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.confidence_belt import IDENTIFIABLE_RATIO
from device.measurement.parameters import EVEN_STD, RANGES
from device.measurement.quantities import UNKNOWNS
from host_tools.press_models.mode_outcome import EvaluatedPresses
from host_tools.press_models.mode_statistics import (
    OCTILES,
    PARTS,
    half_width_by_ramps,
    interval_score,
    octile_of,
    statistics,
)

COUNT = 4000
EVEN = np.tile((2 * np.arange(COUNT) + 1)[:, None] / COUNT - 1, 3)


def presses_of(mean, spread=0.1, truth=EVEN):
    """Return presses whose intervals are two spreads on either side of the mean, within the range."""
    mean, spread = (np.array(np.broadcast_to(part, truth.shape), float) for part in (mean, spread))
    known = spread < IDENTIFIABLE_RATIO * EVEN_STD
    low, high = (np.where(known, np.clip(mean + sign * 2 * spread, -1, 1), sign) for sign in (-1, 1))
    return EvaluatedPresses(truth, mean, low, high, known)


def of(mean, spread=0.1, truth=EVEN):
    return statistics(presses_of(mean, spread, truth))


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


SHUFFLED = np.column_stack([EVEN[:, 0], EVEN[::-1, 0], np.random.default_rng(3).permutation(EVEN[:, 0])])
"""Depths fall where sizes grow; moduli are as they come."""


def test_coverage_is_told_by_the_octiles_of_every_unknown():
    """Of sizes those are missed whose modulus lies in the first octile; depths whose size lies in the last one."""
    aside = np.zeros((COUNT, 3))
    aside[SHUFFLED[:, 2] < -0.75, 0] = 0.3
    aside[SHUFFLED[:, 0] > 0.75, 1] = 0.3
    found = of(SHUFFLED + aside, truth=SHUFFLED)
    size, depth, modulus = (found[name]["coverage_by_octiles"] for name in UNKNOWNS)
    assert set(size) == set(depth) == set(modulus) == set(UNKNOWNS)
    assert size["youngs_modulus_kpa"] == pytest.approx([0.0] + [1.0] * 7, abs=0.15)
    assert size["size_mm"][:7] == pytest.approx([7 / 8] * 7, abs=0.05)
    assert depth["size_mm"] == pytest.approx([1.0] * 7 + [0.0], abs=1e-3)
    assert depth["depth_mm"] == pytest.approx([0.0] + [1.0] * 7, abs=1e-3)
    assert modulus == {name: [1.0] * OCTILES for name in UNKNOWNS}
    for name in UNKNOWNS:
        assert found[name]["coverage_per_octile"] == found[name]["coverage_by_octiles"][name]


def test_what_is_determined_is_told_by_the_octiles_of_every_unknown():
    """The size where the depth lies in the upper half, which is where the size lies in the lower one."""
    spread = np.full((COUNT, 3), 0.1)
    spread[SHUFFLED[:, 1] < 0, 0] = 0.6 * EVEN_STD
    found = of(SHUFFLED, spread, SHUFFLED)["size_mm"]
    assert found["determined"] == 0.5
    assert found["determined_by_octiles"]["depth_mm"] == [0.0] * 4 + [1.0] * 4
    assert found["determined_by_octiles"]["size_mm"] == [1.0] * 4 + [0.0] * 4
    assert found["determined_per_octile"] == found["determined_by_octiles"]["size_mm"]
    assert found["determined_by_octiles"]["youngs_modulus_kpa"] == pytest.approx([0.5] * 8, abs=0.1)
    assert found["coverage_by_octiles"]["depth_mm"][:4] == [None] * 4


def test_intervals_hold_together_where_all_of_them_do():
    """Of a hundred presses the size is missed in 10, the depth in 20 others, the modulus in 5 of those and 5 more."""
    truth = np.zeros((100, 3))
    mean = np.zeros((100, 3))
    mean[:10, 0] = mean[10:30, 1] = mean[25:35, 2] = 0.5
    joint = of(mean, truth=truth)["joint"]
    assert joint == {"size_and_depth": 0.7, "all": 0.65}


def test_intervals_together_are_counted_where_all_of_them_are_determined():
    """The modulus is known in 40 of 100 presses, the depth missed in 10 of these and in 20 of the others."""
    truth, mean, spread = np.zeros((100, 3)), np.zeros((100, 3)), np.full((100, 3), 0.1)
    spread[40:, 2] = 0.6 * EVEN_STD
    mean[30:60, 1] = 0.5
    assert of(mean, spread, truth)["joint"] == {"size_and_depth": 0.7, "all": 0.75}
    assert of(mean, 0.6 * EVEN_STD, truth)["joint"] == {"size_and_depth": None, "all": None}


def test_joint_regions_are_counted_in_all_presses_where_a_mode_has_them():
    truth = np.zeros((10, 3))
    presses = replace(presses_of(truth, truth=truth), in_region=np.array([[True, False]] * 6 + [[True, True]] * 4))
    assert statistics(presses)["joint_region"] == {"size_and_depth": 1.0, "all": 0.4}
    assert "joint_region" not in of(truth, truth=truth)


def test_half_widths_are_told_by_the_ramps_of_a_scan_in_the_unknowns_own_units():
    """Two ramps: 0.2 either way, 0.8 mm of depth; three: half of that. What is not known has the whole range."""
    truth, spread = np.zeros((4, 3)), np.repeat([0.1, 0.1, 0.05, 0.05], 3).reshape(4, 3)
    spread[0, 0] = 0.6 * EVEN_STD
    found = half_width_by_ramps(presses_of(truth, spread, truth), np.array([2, 2, 3, 3]))
    assert found["2"]["depth_mm"] == pytest.approx([0.8] * 19)
    assert found["3"]["depth_mm"] == pytest.approx([0.4] * 19)
    assert found["2"]["size_mm"][::9] == pytest.approx([1.3 + 0.05 * 5.2, 1.3 + 0.5 * 5.2, 1.3 + 0.95 * 5.2], rel=1e-3)


def test_cells_of_size_and_depth_count_presses_what_is_determined_and_what_is_covered():
    """Ten presses of the smallest size and greatest depth, of which six determine the depth and two miss it."""
    truth = np.tile([-1.0, 1.0, 0.0], (14, 1))
    truth[10:, :2] = 0.1, -0.6
    spread, mean = np.full((14, 3), 0.1), truth + 0.0
    spread[6:10, 1], mean[:2, 1] = 0.6 * EVEN_STD, 0.5
    cells = of(mean, spread, truth)["depth_mm"]["cells"]
    number, other = PARTS - 1, 2 * PARTS
    assert [cells[name][number] for name in ("presses", "determined", "covered")] == [10, 6, 4]
    assert [cells[name][other] for name in ("presses", "determined", "covered")] == [4, 4, 4]
    assert [sum(cells[name]) for name in ("presses", "determined", "covered")] == [14, 10, 8]


def test_an_interval_scores_its_width_and_twenty_times_what_it_misses_by():
    """2 / (1 - 0.9) = 20. Size: 0.4 and held. Depth: 0.2 and 0.1 too low, 2.2. Modulus: 0.6 and 0.05 too high, 1.6."""
    truth = np.array([[0.0, 0.3, -0.45]])
    low, high = np.array([[-0.1, 0.0, -0.4]]), np.array([[0.3, 0.2, 0.2]])
    presses = EvaluatedPresses(truth, truth, low, high, np.ones((1, 3), bool))
    np.testing.assert_allclose(interval_score(presses), [0.4, 2.2, 1.6])


def test_the_interval_score_is_the_mean_over_presses_and_stands_by_each_unknown():
    """Whole ranges score 2; intervals of 0.4 that hold 0.4: half of each is 1.2."""
    spread = np.where(np.arange(COUNT) % 2, 0.1, 0.6 * EVEN_STD)[:, None]
    truth = 0.5 * EVEN
    found = of(truth, spread, truth)
    np.testing.assert_allclose(interval_score(presses_of(truth, spread, truth)), 1.2)
    assert [found[name]["interval_score"] for name in UNKNOWNS] == pytest.approx([1.2] * 3)


def test_no_interval_scores_less_on_average_than_the_quantiles():
    """Gaussian errors of 0.1: 1.2, 1.645 and 2.2 deviations either way."""
    truth = np.random.default_rng(4).normal(0, 0.1, (20_000, 3))
    scores = [
        interval_score(
            EvaluatedPresses(truth, 0 * truth, 0 * truth - half, 0 * truth + half, np.ones_like(truth, bool))
        )
        for half in (0.12, 0.1645, 0.22)
    ]
    assert (scores[1] < scores[0]).all()
    assert (scores[1] < scores[2]).all()
