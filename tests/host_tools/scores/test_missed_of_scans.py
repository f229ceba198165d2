"""What a forward model misses moves answers as first order says, and scans are answered with it and without."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from small_surrogate import LinearRows, white_noise

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS
from device.measurement.parameters import PARAMETERS, denormalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.radial_profile import COLUMNS, RESPONSE
from device.measurement.ramp_modes.surrogate import OFFSET
from host_tools.scores.noise_free import RAMPS, missed_chapter, moved_by

STD = 0.02
TRUTH = np.array([0.2, -0.3, 0.1, 0.1, -0.2, 0.3, 0.0, -0.1, -0.4])
OFFSETS_MM, ALONG = np.array([0.6, 4.0]), np.zeros(2)


@pytest.fixture(scope="module")
def linear():
    """What a press tells is its coordinates times random slopes; the reference press knows of no offset."""
    slopes = np.random.default_rng(5).normal(0.0, 0.02, (len(PARAMETERS), COLUMNS))
    slopes[OFFSET] /= 4
    slopes[OFFSET, RESPONSE] = 0.0
    answers = RampAnswers(LinearRows(slopes), white_noise(STD))
    return SimpleNamespace(
        answers=answers,
        answer=lambda rows, direction_rad: answers.answer(rows, np.zeros((len(rows), 3)), direction_rad),
    )


def rows_of(linear):
    each = np.tile(TRUTH, (2, 1))
    each[:, OFFSET] = OFFSETS_MM - 1  # coordinate -1 is the axis, 1 lies 2 mm off
    return linear.answers.surrogate.rows(each, ALONG)


def test_a_miss_moves_the_answer_of_a_linear_press_as_far_as_is_said(linear):
    rows = rows_of(linear)
    missed = np.random.default_rng(7).normal(0.0, STD / 4, rows.shape)
    missed[1, RESPONSE] = missed[0, RESPONSE]
    moves = moved_by(missed, rows, linear, denormalise(TRUTH), OFFSETS_MM, ALONG)
    before, after = (linear.answer(seen, ALONG) for seen in (rows, rows + missed))
    np.testing.assert_allclose(moves, (after.fit.best - before.fit.best)[:3] / before.spread, atol=0.04)
    assert np.abs(moves).max() > 0.2


def test_what_is_missed_counts_in_proportion(linear):
    rows = rows_of(linear)
    missed = np.full(rows.shape, STD)
    once, twice = (moved_by(part * missed, rows, linear, denormalise(TRUTH), OFFSETS_MM, ALONG) for part in (1.0, 2.0))
    np.testing.assert_allclose(twice, 2 * once, rtol=1e-12)


def test_scans_of_the_probe_are_answered_with_what_is_missed_and_without(tables):
    chapter = missed_chapter(read_ramp_model(MODELS / "standard"), tables, scans=2, seed=3, jobs=1)
    (table,) = chapter.tables
    assert [row[0] for row in table.rows] == [str(ramps) for ramps in RAMPS]
    farthest = [float(row[5]) for row in table.rows]
    assert all(0 < float(move) <= far for row, far in zip(table.rows, farthest, strict=True) for move in row[1:5])
    assert all(share in {"0%", "50%", "100%"} for row in table.rows for share in row[6:])
    assert len(chapter.benchmarks) == 2 * len(RAMPS)


def test_one_scan_is_too_few(linear):
    with pytest.raises(InvalidQuantity, match="scans is 1"):
        missed_chapter(linear, None, scans=1)
