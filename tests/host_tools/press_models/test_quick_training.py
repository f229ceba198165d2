"""What mode quick's training makes of recordings and of answers; the networks are toys that read their answer."""

from __future__ import annotations

import numpy as np
import pytest

from device.measurement.confidence_belt import ends_in_belts
from device.measurement.parameters import PARAMETERS, denormalise
from device.measurement.quick_mode.profile import quick_press
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models import measured_noise, quick_training
from host_tools.press_models.confidence_belts import SpreadAnswers
from host_tools.press_models.press_samples import profile_rows
from host_tools.press_models.quick_training import CRITICAL_RATIO, RecordedHolds, recorded_holds
from host_tools.press_models.recorded_presses import EXACT, direction_of_press_rad, recorded_press
from host_tools.press_models.seeds import press_seed

STD, SIMULATED, RECORDED = 0.1, 6000, 200


class FirstColumns:
    """In place of an ensemble: the first three columns are the coordinates, whose spread is known."""

    def estimate(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return rows[:, :3], np.full((len(rows), 3), STD)


def answers(error: float) -> tuple[SpreadAnswers, SpreadAnswers, RecordedHolds]:
    """Two sets of simulated answers with Gaussian errors of the stated spread, and recordings with larger ones."""
    rng = np.random.default_rng(1)
    truth = rng.uniform(-1, 1, (SIMULATED, 3))
    simulated = SpreadAnswers(truth, truth + rng.normal(0, STD, truth.shape), np.full(truth.shape, STD))
    normalised = rng.uniform(-0.9, 0.9, (RECORDED, len(PARAMETERS)))
    rows = np.zeros((RECORDED, RINGS + 1))
    rows[:, :3] = normalised[:, :3] + rng.normal(0, error * STD, (RECORDED, 3))
    half = SIMULATED // 2
    of_belts, judged = simulated.part(slice(half)), simulated.part(slice(half, None))
    return of_belts, judged, RecordedHolds(denormalise(normalised), rows, np.arange(1.0, RECORDED + 1))


@pytest.mark.parametrize("error", [1.0, 1.6])
def test_belts_cover_recordings_also_where_simulated_presses_promise_too_much(error):
    outcome = quick_training._outcome(FirstColumns(), *answers(error))
    assert outcome.recorded.is_known.all()
    assert outcome.recorded.is_covered.mean() == pytest.approx(0.9, abs=0.05)


def test_limits_come_from_the_first_half_of_the_recordings_and_the_second_is_kept_to_count_on():
    of_belts, judged, recorded = answers(1.0)
    outcome = quick_training._outcome(FirstColumns(), of_belts, judged, recorded)
    half = RECORDED // 2
    assert outcome.elongation_ratio == pytest.approx(1 + CRITICAL_RATIO * (half - 1))
    np.testing.assert_array_equal(outcome.recorded.mean, recorded.rows[half:, :3])
    np.testing.assert_array_equal(outcome.simulated.truth, judged.truth)


def test_the_intervals_that_are_counted_are_those_of_the_belts():
    outcome = quick_training._outcome(FirstColumns(), *answers(1.0))
    for presses in (outcome.simulated, outcome.recorded):
        ends = ends_in_belts(presses.mean[3], np.full(3, STD), outcome.belts)
        np.testing.assert_array_equal(presses.low[3], ends.low)
        np.testing.assert_array_equal(presses.high[3], ends.high)


def test_recordings_are_those_of_each_press_with_its_own_seed(tables):
    found = recorded_holds(tables, 2, 17, ErrorLevels(), jobs=1)
    for number in range(2):
        alone = recorded_press(tables, found.parameters[number], "quick", press_seed(17, number), levels=ErrorLevels())
        row, ratio = quick_press(alone)
        np.testing.assert_array_equal(found.rows[number], row)
        assert found.elongation[number] == ratio


def test_the_cameras_part_of_the_noise_is_that_of_recordings_without_drift(tables, monkeypatch):
    """Less than the drift of 1 % that is added on top of it, and not nothing; about presses in their own directions."""
    pressed = []

    def exact(tables, parameters, direction_rad):
        pressed.append(direction_rad)
        return profile_rows(tables, parameters, direction_rad)

    monkeypatch.setattr(measured_noise, "profile_rows", exact)
    std = np.sqrt(np.diag(quick_training.camera_of_a_hold(tables, 3, 5, 1)))
    assert std.shape == (RINGS,)
    assert (std > 1e-4).all()
    assert (std < ErrorLevels().gain_ratio).all()
    own = [direction_of_press_rad(press_seed(5, number)) for number in range(3)]
    assert np.concatenate(pressed).tolist() == own
    assert recorded_holds(tables, 1, 5, EXACT, 1).rows[0, RINGS] == pytest.approx(0.5, abs=0.06)
