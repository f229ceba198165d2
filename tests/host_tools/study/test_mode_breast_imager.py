"""The published inclusions: which answers are scored, and that a refusal is no error."""

import pytest

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from host_tools.phantom_sets import breast_imager
from host_tools.study.mode_breast_imager import _judged, _row


def answer(size_mm, *, identifiable=True, modulus=(20.0, 90.0)):
    size = Quantity(size_mm, size_mm - 1, size_mm + 1, 0.5, identifiable)
    modulus_kpa = Quantity(40.0, *modulus, 20.0, True)
    return Estimate(size, size, modulus_kpa, "ok", "", "standard", "m", "0", "c", True, {"misfit_ratio": 0.5})


REFUSED = Estimate(*[UNKNOWN_QUANTITY] * 3, "outside_range", "Two lumps.", "standard", "m", "0", "c", True, features={})


@pytest.fixture
def phantoms():
    return list(breast_imager())[:2]


def test_the_error_in_size_is_of_the_answers_that_determine_it(phantoms):
    """Two inclusions of 5 mm: 10 % and, not determined, 100 % off; the third press is refused."""
    found = [[answer(5.5), answer(10.0, identifiable=False)], [REFUSED]]
    size, modulus = _judged("standard", phantoms, found)
    assert size.measured == pytest.approx(10.0)
    assert not size.passed
    assert modulus.measured == 1.0


def test_an_interval_that_misses_the_modulus_counts(phantoms):
    found = [[answer(5.0, modulus=(30.0, 50.0))], [answer(5.0)]]
    size, modulus = _judged("standard", phantoms, found)
    assert size.passed
    assert modulus.measured == 0.5


def test_without_any_answer_nothing_passes(phantoms):
    assert not any(benchmark.passed for benchmark in _judged("standard", phantoms, [[REFUSED], [REFUSED]]))
    assert _row("standard", phantoms[0], [REFUSED])[3:] == ("0 of 1", "-", "0", "0", "-")
