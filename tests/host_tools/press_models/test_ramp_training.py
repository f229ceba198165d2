"""What the training of the ramp modes judges them on: where scans are pressed, and their simulated presses."""

import numpy as np
import pytest
from small_surrogate import COLUMNS, LinearRows, white_noise

from device.measurement.parameters import HIGH, PARAMETERS, normalise
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.radial_profile import FIRST, NETWORK_NAMES, SECOND, SeenPresses, network_rows
from device.measurement.ramp_modes.surrogate import OFFSET, WAVES
from host_tools.press_models import ramp_training, train_range
from host_tools.press_models.fit_surrogate import (
    BESIDE_REACH,
    INCLUSION_HIGHEST,
    INCLUSION_REACH,
    PRESSES_A_TERM,
    TURNED_REACH,
    degrees,
    scaled,
)
from host_tools.press_models.press_samples import BESIDE_TO_MM, draw_parameters
from host_tools.press_models.ramp_training import (
    DRY_RUN,
    FURTHER_MM,
    NEAREST_MM,
    STRAY_MM,
    ModeEvaluation,
    TrainingBudget,
    further_offsets_mm,
    guess_of,
    log_odds_of,
)
from host_tools.press_models.recorded_presses import RecordedPresses

COUNT = 4000


@pytest.fixture(scope="module")
def offsets() -> list[np.ndarray]:
    return further_offsets_mm(COUNT, np.random.default_rng(1))


def test_scans_have_one_to_four_further_ramps_in_turn(offsets):
    assert [len(one) for one in offsets[:8]] == [1, 2, 3, 4, 1, 2, 3, 4]


def test_a_hand_strays_about_where_each_ramp_is_meant_to_lie_within_what_the_surrogate_knows(offsets):
    for number, meant_mm in enumerate(FURTHER_MM):
        found = np.array([one[number] for one in offsets if len(one) > number])
        assert np.median(found) == pytest.approx(meant_mm, abs=0.15)
        assert np.subtract(*np.quantile(found, [0.75, 0.25])) == pytest.approx(1.349 * STRAY_MM, rel=0.1)
    everywhere = np.concatenate(offsets)
    assert everywhere.min() >= NEAREST_MM
    assert everywhere.max() <= BESIDE_TO_MM


@pytest.mark.parametrize("budget", [DRY_RUN, TrainingBudget()], ids=["dry run", "whole"])
def test_a_budget_has_presses_enough_for_the_terms_of_its_polynomials(budget):
    """Those that follow the inclusion: of the mean over all directions, and of each wave of the direction."""
    of_waves = len(WAVES) * len(degrees(scaled(TURNED_REACH, budget.detail_ratio), {}))
    assert budget.ranges.detail_ratio == budget.detail_ratio
    for presses, reach, highest in (
        (budget.presses, INCLUSION_REACH, INCLUSION_HIGHEST),
        (budget.beside, BESIDE_REACH, INCLUSION_HIGHEST),
        (budget.ranges.presses, train_range.REACH, train_range.HIGHEST),
    ):
        assert presses >= PRESSES_A_TERM * (len(degrees(scaled(reach, budget.detail_ratio), highest)) + of_waves)


def slopes_of_offset() -> LinearRows:
    """Return rows whose first harmonic is the offset in mm."""
    slopes = np.zeros((len(PARAMETERS), COLUMNS))
    slopes[OFFSET, FIRST] = HIGH[OFFSET] / 2
    return LinearRows(slopes)


@pytest.mark.parametrize("further_mm", [np.zeros(0), np.array([4.0, 6.5])])
def test_a_simulated_press_lies_where_it_was_drawn_and_further_ones_where_they_are_meant(further_mm):
    """Coordinates of 0 to 2 mm run from -1 to 1; noise is next to none."""
    answers = RampAnswers(slopes_of_offset(), white_noise(1e-6))
    at = normalise(draw_parameters(1, np.random.default_rng(2)))[0]
    rows, direction_rad = ramp_training._simulated(answers, at, further_mm, [1, 2])
    assert len(np.unique(direction_rad)) == len(rows) == 1 + len(further_mm)
    seen_mm = rows[:, FIRST].mean(axis=1) + HIGH[OFFSET] / 2
    np.testing.assert_allclose(seen_mm, [at[OFFSET] + 1, *further_mm], atol=1e-4)
    again, other = (ramp_training._simulated(answers, at, further_mm, [1, number]) for number in (2, 3))
    np.testing.assert_array_equal(again[0], rows)
    np.testing.assert_array_equal(again[1], direction_rad)
    assert (other[0] != rows).any()
    assert (other[1] != direction_rad).all()


@pytest.mark.parametrize("mode", ["standard", "precise"])
def test_presses_are_answered_in_the_directions_in_which_they_were_drawn_or_seen(monkeypatch, mode):
    """Simulated rows tell theirs: their second harmonic is three times their wave."""
    along, asked = np.zeros(COLUMNS), []
    along[SECOND] = 3.0
    answers = RampAnswers(LinearRows(slopes_of_offset().slopes, along), white_noise(1e-6))
    seen = [SeenPresses(np.zeros((2, COLUMNS)), np.zeros(0), np.array([0.3, number])) for number in range(3)]
    recorded = RecordedPresses(np.zeros((3, len(PARAMETERS))), seen)
    monkeypatch.setattr(ramp_training, "record_presses", lambda *args, **others: recorded)
    monkeypatch.setattr(ramp_training, "answers_to", lambda *told: asked.append(told[2:4]))
    monkeypatch.setattr(ramp_training, "evaluated", lambda truth, found: None)
    monkeypatch.setattr(ramp_training, "outcome_of", lambda *found: None)
    ModeEvaluation(None, answers, lambda rows: rows, lambda rows: rows, jobs=1).of_mode(mode, 4, 3)
    (rows, directions), (recorded_rows, recorded_directions) = asked
    assert [len(one) for one in directions] == ([1] * 4 if mode == "standard" else [2, 3, 4, 5])
    for one, direction_rad in zip(rows, directions, strict=True):
        np.testing.assert_allclose(one[:, SECOND].mean(axis=1), 3 * np.cos(2 * direction_rad), atol=1e-4)
    for one, of_one, direction_rad in zip(seen, recorded_rows, recorded_directions, strict=True):
        assert of_one is one.rows
        assert direction_rad is one.direction_rad


def test_guesses_and_odds_are_of_what_networks_read_of_rows():
    rows = np.random.default_rng(3).normal(size=(2, COLUMNS))
    asked = []

    class Network:
        network = property(lambda self: self)

        def estimate(self, read):
            asked.append(read)
            return read[:, :3], None

        def log_odds(self, read):
            asked.append(read)
            return read[:, 0]

    np.testing.assert_array_equal(guess_of(Network())(rows), rows[:, :3])
    np.testing.assert_array_equal(log_odds_of(Network())(rows), rows[:, 0])
    for read in asked:
        np.testing.assert_array_equal(read, network_rows(rows))
        assert read.shape == (2, len(NETWORK_NAMES))


def test_recordings_of_a_scan_have_as_many_ramps_as_simulated_ones(monkeypatch):
    """And both are judged by the same answers; a single ramp has none further."""
    asked = {}

    def record_presses(tables, parameters, mode, *, further_mm, **others):
        asked[mode] = [len(one) for one in further_mm]
        raise InterruptedError

    monkeypatch.setattr(ramp_training, "record_presses", record_presses)
    answers = RampAnswers(slopes_of_offset(), white_noise(1e-3))
    evaluation = ModeEvaluation(None, answers, lambda rows: np.zeros((1, 3)), lambda rows: rows, jobs=1)
    for mode in ("standard", "precise"):
        with pytest.raises(InterruptedError):
            evaluation.of_mode(mode, 1, 5)
    assert asked == {"standard": [], "precise": [1, 2, 3, 4, 1]}
