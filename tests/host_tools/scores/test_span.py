"""The shift of an answer, against one that is known: a change along the Jacobian moves the answer along with it."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2
from small_surrogate import random_scan_surrogate, white_noise

from device.measurement.ramp_modes.answers import RampAnswers
from host_tools.scores import span
from host_tools.scores.span import LARGER_RATIOS, SCAN_MM, SPAN_ERROR_RATIO, Moved, moved_by, power, span_chapter

COUNT_OF_COLUMNS = 60


@pytest.fixture(scope="module")
def jacobian():
    """Steep enough that the ranges do not count."""
    return 1e3 * np.random.default_rng(1).normal(size=(COUNT_OF_COLUMNS, 9))


def test_what_another_inclusion_would_change_shifts_the_answer_to_that_inclusion_and_explains_all(jacobian):
    """A thousandth of the range in each unknown: over their own spreads, the shifts stand as these do."""
    moved = [moved_by(1e-3 * jacobian[:, i], jacobian) for i in range(3)]
    shifts = np.array([one.shift for one in moved])
    assert np.abs(np.diag(shifts)).min() > 100 * np.abs(shifts - np.diag(np.diag(shifts))).max()
    assert max(one.unexplained for one in moved) < 0.01


def test_what_no_inclusion_would_change_shifts_nothing_and_is_left_whole(jacobian):
    across = np.linalg.qr(jacobian, mode="complete")[0][:, -1]
    moved = moved_by(4.0 * across, jacobian)
    np.testing.assert_allclose(moved.shift, 0.0, atol=1e-9)
    assert moved.unexplained == pytest.approx(4.0)


def test_the_power_of_nothing_is_the_false_share_and_grows_to_one():
    columns, false_share = 100, 0.0125
    critical = float(chi2.isf(false_share, columns)) / columns
    powers = [power(Moved(np.zeros(3), unexplained, columns), critical) for unexplained in (0.0, 3.0, 6.0, 20.0)]
    assert powers[0] == pytest.approx(false_share, rel=1e-3)
    assert powers == sorted(powers)
    assert powers[-1] > 0.999


def test_the_chapter_passes_where_the_span_moves_nothing_and_asks_for_press_and_scan(tables, monkeypatch):
    answers = RampAnswers(random_scan_surrogate(), white_noise(1e-3))
    critical = dict.fromkeys(("standard", "precise"), SimpleNamespace(misfit_ratio=1.5))
    asked = []

    def rows(tables, parameters, *, span_ratio=1.0, reference_span_ratio=None):
        asked.append((len(parameters), round(span_ratio - 1, 6), reference_span_ratio))
        return np.zeros((len(parameters), len(answers.noise.camera)))

    monkeypatch.setattr(span, "profile_rows", rows)
    monkeypatch.setattr(span, "PRESSES", 2)
    monkeypatch.setattr(span, "SCANS", 1)
    chapter = span_chapter(SimpleNamespace(answers=answers, critical=critical), tables, jobs=1)
    assert (1, SPAN_ERROR_RATIO, None) in asked
    assert {(len(SCAN_MM), ratio, end) for ratio in LARGER_RATIOS for end in (None, 1.0)} <= set(asked)
    assert [(one.case, one.measured) for one in chapter.benchmarks] == [
        ("standard, size", 0.0),
        ("standard, depth", 0.0),
        ("standard, Young's modulus", 0.0),
    ]
    assert len(chapter.tables[0].rows) == 2 * len(LARGER_RATIOS)
