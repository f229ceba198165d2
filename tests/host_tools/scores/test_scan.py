"""Scans ramp by ramp on a linear forward model, and how their answers are counted."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from small_surrogate import LinearRows, white_noise

from device.measurement.confidence_belt import IDENTIFIABLE_RATIO
from device.measurement.parameters import EVEN_STD, NEAR_NOMINAL, PARAMETERS, RANGES, box_of, normalise_unknowns
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.radial_profile import COLUMNS, FIRST, RESPONSE
from device.measurement.ramp_modes.surrogate import OFFSET
from host_tools.press_models.mode_outcome import EvaluatedPresses
from host_tools.scores import scan
from host_tools.scores.scan import (
    MOST_RAMPS,
    ScansOfLength,
    answered_scans,
    answers_by_ramps,
    bound_in_box,
    scan_chapter,
)

STD = 0.02
TRUTH = np.array([0.2, -0.3, 0.1, 0.1, -0.2, 0.3, 0.0, -0.1, -0.4])
OFFSETS_MM = np.array([0.6, 4.0, 6.0])
WHOLE = np.ones(len(PARAMETERS))
EVEN = EVEN_STD * WHOLE


@pytest.fixture(scope="module")
def model():
    """What a press tells is its coordinates times random slopes; the reference press knows of no offset."""
    slopes = np.random.default_rng(5).normal(0.0, 0.02, (len(PARAMETERS), COLUMNS))
    slopes[OFFSET] /= 4
    slopes[OFFSET, RESPONSE] = 0.0
    answers = RampAnswers(LinearRows(slopes), white_noise(STD))
    return stand_in(answers)


def stand_in(answers):
    """Return a model whose first guesses lie in the middle of the ranges."""
    return SimpleNamespace(
        answers=answers,
        answer=lambda rows, direction_rad: answers.answer(rows, np.zeros((len(rows), 3)), direction_rad),
    )


def test_each_further_ramp_is_answered_with_those_before_it(model):
    found = answers_by_ramps(model, TRUTH, OFFSETS_MM, np.random.default_rng(2), WHOLE)
    assert [len(one.answer.fit.mean) for one in found] == [9, 10, 11]
    assert all(one.cpu_s > 0 for one in found)
    np.testing.assert_allclose(found[-1].answer.mean, TRUTH[:3], atol=4 * found[-1].least_spread.max())


def test_ramps_are_answered_in_the_directions_in_which_they_were_drawn(model):
    """What a direction adds, five times the noise, is explained whatever it was: misfits are those of noise."""
    along = np.zeros(COLUMNS)
    along[FIRST] = 5 * STD * np.random.default_rng(4).choice([-1.0, 1.0], FIRST.stop - FIRST.start)
    turned = RampAnswers(LinearRows(model.answers.surrogate.slopes, along), model.answers.noise)
    found = answers_by_ramps(stand_in(turned), TRUTH, OFFSETS_MM, np.random.default_rng(2), WHOLE)
    assert max(one.answer.misfit_ratio for one in found) < 1.3
    deaf = SimpleNamespace(answers=turned, answer=lambda rows, _: turned.answer(rows, np.zeros((len(rows), 3))))
    assert answers_by_ramps(deaf, TRUTH, OFFSETS_MM, np.random.default_rng(2), WHOLE)[-1].answer.misfit_ratio > 2


def test_the_bound_falls_with_the_ramps_and_is_reached_on_a_linear_model(model):
    found = answers_by_ramps(model, TRUTH, OFFSETS_MM, np.random.default_rng(2), WHOLE)
    bounds = np.array([one.least_spread for one in found])
    assert (np.diff(bounds, axis=0) < 0).all()
    for one in found[1:]:
        np.testing.assert_allclose(one.answer.spread, one.least_spread, rtol=0.2)


def linear_press(std: float, slope: float, modulus_std: float) -> np.ndarray:
    """Return the whitened derivatives [3, 9] of a press that sees size + slope x modulus, depth, and the modulus."""
    jacobian = np.zeros((3, len(PARAMETERS)))
    jacobian[0, 0], jacobian[0, 2] = 1 / std, slope / std
    jacobian[1, 1], jacobian[2, 2] = 1 / std, 1 / modulus_std
    return jacobian


def test_the_bound_in_the_box_of_a_modulus_of_which_nothing_is_seen_is_that_of_its_range():
    """It is even, with a standard deviation of 0.577; the size hangs on it by 0.03."""
    found = bound_in_box(linear_press(0.01, 0.03, 1e3), 0.4, EVEN)
    np.testing.assert_allclose(found.rms, [np.hypot(0.01, 0.03 * EVEN_STD), 0.01, EVEN_STD], rtol=0.01)
    assert found.determined == 0.0


def test_far_from_its_ends_the_bound_in_the_box_is_that_of_cramer_and_rao():
    found = bound_in_box(linear_press(0.01, 0.3, 0.1), 0.0, EVEN)
    np.testing.assert_allclose(found.rms, [np.hypot(0.01, 0.03), 0.01, 0.1], rtol=0.02)
    assert found.determined == 1.0


def test_the_best_estimate_errs_by_the_bound_in_the_box_and_is_as_often_determined():
    """Sampled: even moduli, seen with 0.4; the mean of what is left errs by the root of its mean variance."""
    rng, std = np.random.default_rng(1), 0.4
    truth = rng.uniform(-1, 1, 4000)
    seen = truth + std * rng.standard_normal(len(truth))
    grid = np.linspace(-1, 1, 201)
    left = np.exp(-((grid - seen[:, None]) ** 2) / (2 * std**2))
    left /= left.sum(axis=1, keepdims=True)
    mean = left @ grid
    spread = np.sqrt(left @ grid**2 - mean**2)
    bounds = [bound_in_box(linear_press(0.01, 0.0, std), one, EVEN) for one in truth[::40]]
    least = np.sqrt(np.mean([one.rms[2] ** 2 for one in bounds]))
    assert least == pytest.approx(np.sqrt(np.mean((mean - truth) ** 2)), rel=0.04)
    assert least < 0.4 * 0.9  # the range's ends tell something
    determined = np.mean(spread < IDENTIFIABLE_RATIO * EVEN_STD)
    assert 0.05 < determined < 0.95
    assert np.mean([one.determined for one in bounds]) == pytest.approx(determined, abs=0.04)


def test_all_numbers_of_ramps_are_of_the_same_inclusions(model):
    found = answered_scans(model, seed=3, scenes=1, jobs=1)
    assert len(found) == 1 + MOST_RAMPS
    for one in found:
        np.testing.assert_array_equal(one.presses.truth, found[0].presses.truth)
        assert one.presses.truth.shape == one.least_spread.shape == (1, 3)
    again, other = (answered_scans(model, seed=seed, scenes=1, jobs=1)[1].presses.mean for seed in (3, 4))
    np.testing.assert_array_equal(again, found[1].presses.mean)
    assert not np.array_equal(again, other)


def test_bounds_know_that_tissue_is_near_nominal(model):
    """The same presses: what they tell of the unknowns hangs on the tissue, of which the narrower range knows more."""
    half = box_of(NEAR_NOMINAL).half
    wide, narrow = (
        answers_by_ramps(model, TRUTH, OFFSETS_MM[:1], np.random.default_rng(2), known)[0] for known in (WHOLE, half)
    )
    np.testing.assert_array_equal(narrow.answer.mean, wide.answer.mean)
    assert (narrow.least_spread < wide.least_spread).all()
    near, anywhere = (
        answered_scans(model, seed=3, scenes=1, ranges=ranges, jobs=1)[0] for ranges in (NEAR_NOMINAL, RANGES)
    )
    np.testing.assert_array_equal(near.presses.truth, anywhere.presses.truth)
    assert not np.array_equal(near.presses.mean, anywhere.presses.mean)


def made(error: float, known: list[bool], least: float = 0.1) -> ScansOfLength:
    """Return answers to as many scans of 8.5 mm, 8 mm and 40 kPa, each 1 + `error` of it; intervals of 20 %."""
    truth = np.tile([8.5, 8.0, 40.0], (len(known), 1))
    low, mean, high = (normalise_unknowns(part * (1 + error) * truth) for part in (0.8, 1.0, 1.2))
    is_known = np.repeat(np.array(known)[:, None], 3, axis=1)
    presses = EvaluatedPresses(normalise_unknowns(truth), mean, low, high, is_known)
    bounds = np.full((len(known), 3), least)
    return ScansOfLength(presses, np.full(len(known), 0.05), bounds, bounds, np.full(len(known), 0.7))


def test_the_chapter_judges_scans_of_two_and_of_four(monkeypatch):
    """One press errs by 20 %; two by 10 %, of which half is determined; four by 15 %, all determined."""
    half, whole = [True, False], [True, True]
    one = made(0.2, half, least=2 * EVEN_STD * IDENTIFIABLE_RATIO)
    by_ramps = [one, one, made(0.1, half), made(0.1, whole), made(0.15, whole)]
    monkeypatch.setattr(scan, "answered_scans", lambda model, *, seed, scenes, ranges, jobs: by_ramps)
    chapter = scan_chapter(None)
    measured = [(found.case, pytest.approx(found.measured), found.passed) for found in chapter.benchmarks]
    assert [case for case, _, _ in measured[8:]] == [f"scan of {n}, tissue near nominal" for n in (2,) * 4 + (4,) * 4]
    assert measured[:8] == [
        ("scan of 2", 0.5, False),
        ("scan of 2", 10.0, True),
        ("scan of 2", 0.5, True),
        ("scan of 2", 0.5, True),
        ("scan of 4", 1.0, True),
        ("scan of 4", 15.0, True),
        ("scan of 4", 0.75, False),
        ("scan of 4", 0.75, False),
    ]
    assert [table.caption for table in chapter.tables] == [
        "By the number of ramps",
        "By the number of ramps, tissue near nominal",
    ]
    rows = chapter.tables[0].rows
    assert [row[0] for row in rows] == ["1, on the axis", "1", "2", "3", "4"]
    assert rows[0][1:5] == ("50%", "0%", "70%", "20.0")
    assert rows[2][1:10] == ("50%", "100%", "70%", "10.0", "0.85", "0.65", "0.80", "0.40", "0.50")
    assert rows[2][10:] == ("0.17", "0.50", "0.17", "100%", "100%", "100%", "50")
    assert len(rows[2]) == len(chapter.tables[0].header)


def test_where_nothing_is_determined_nothing_passes():
    found = made(0.1, [False])
    assert np.isnan(found.median_percent)
    assert found.held(0) == "-"
    share, median, *_ = scan._benchmarks("scan of 2", 2, found, found.rmse)
    assert not share.passed
    assert not median.passed


def test_one_scan_is_no_score():
    with pytest.raises(InvalidQuantity, match="scenes is 1, but must be at least 2"):
        scan_chapter(None, scenes=1)
