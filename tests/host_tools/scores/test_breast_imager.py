"""The published inclusions: which answers are scored, and that a refusal is no error."""

import numpy as np
import pytest

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from host_tools.calibration.phantom_sets import breast_imager
from host_tools.scores.breast_imager import _benchmarks, _row


def answer(size_mm, *, identifiable=True, modulus=(20.0, 90.0)):
    size = Quantity(size_mm, size_mm - 1, size_mm + 1, 0.5, identifiable)
    modulus_kpa = Quantity(40.0, *modulus, 20.0, True)
    return Estimate(size, size, modulus_kpa, "ok", "", "standard", "m", "0", "c", True, {"misfit_ratio": 0.5})


REFUSED = Estimate(
    *[UNKNOWN_QUANTITY] * 3, "outside_range", "Two inclusions.", "standard", "m", "0", "c", True, features={}
)
BEST_PERCENT = np.array([20.0, 5.0])
"""The size of the first inclusion is known to 20 % at best, of the second to 5 %."""


@pytest.fixture
def phantoms():
    return list(breast_imager())[:2]


def test_the_error_in_size_is_of_the_answers_that_determine_it(phantoms):
    """Two inclusions of 5 mm: 10 % and, not determined, 100 % off; the third press is refused."""
    found = [[answer(5.5), answer(10.0, identifiable=False)], [REFUSED]]
    of_all, size, over_least, modulus = _benchmarks(phantoms, found, BEST_PERCENT)
    assert of_all.measured == pytest.approx((55.0 + 70.0) / 2)  # the refused one as 8.5 mm
    assert size.measured == pytest.approx(10.0)
    assert not size.passed
    assert over_least.passed
    assert modulus.measured == 1.0


def test_the_least_error_is_that_of_the_recordings_scored(phantoms):
    """Of a Gaussian error the mean size is sqrt(2 / pi) of its standard deviation: two at 20 %, one at 5 %."""
    found = [[answer(5.5), answer(5.5)], [answer(5.5), answer(10.0, identifiable=False), REFUSED]]
    _, _, over_least, _ = _benchmarks(phantoms, found, BEST_PERCENT)
    assert over_least.measured == pytest.approx(10.0 / (15.0 * np.sqrt(2 / np.pi)))


def test_an_interval_that_misses_the_modulus_counts(phantoms):
    found = [[answer(5.0, modulus=(30.0, 50.0))], [answer(5.0)]]
    of_all, size, _, modulus = _benchmarks(phantoms, found, BEST_PERCENT)
    assert of_all.passed
    assert size.passed
    assert modulus.measured == 0.5


def test_without_any_answer_nothing_passes(phantoms):
    assert not any(benchmark.passed for benchmark in _benchmarks(phantoms, [[REFUSED], [REFUSED]], BEST_PERCENT))
    assert _row(phantoms[0], [REFUSED])[2:] == ("0 of 1", "-", "70.0 %", "0", "0", "-")
