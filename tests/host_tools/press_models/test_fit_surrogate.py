"""Polynomials are recovered from their own rows, and which terms they have is counted on paper."""

import math
from dataclasses import replace

import numpy as np
import pytest

from device.measurement.parameters import PARAMETERS, normalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.ellipticity import SECOND_COLUMNS
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, OFFSET_COLUMNS, RESPONSE_COLUMNS, PressSurrogate
from host_tools.press_models import fit_surrogate as module
from host_tools.press_models.fit_surrogate import degrees, fit_surrogate, held_out_error
from host_tools.press_models.press_samples import PressSamples, draw_parameters

NONE = dict.fromkeys(PARAMETERS, 0.5)
SMALL_INCLUSION = dict.fromkeys(PARAMETERS, 1.0) | {"size_mm": 3.0, "depth_mm": 2.0}
SMALL_BASELINE = NONE | {"tissue_modulus_kpa": 2.0, "albedo": 1.0}


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Fifteen terms of the inclusion and four of the light beside it instead of thousands."""
    monkeypatch.setattr(module, "INCLUSION_REACH", SMALL_INCLUSION)
    monkeypatch.setattr(module, "BASELINE_REACH", SMALL_BASELINE)


@pytest.fixture
def truth() -> PressSurrogate:
    rng, inclusion, baseline = np.random.default_rng(1), degrees(SMALL_INCLUSION, {}), degrees(SMALL_BASELINE, {})
    return PressSurrogate(
        LegendreSum(inclusion, rng.normal(size=(len(inclusion), CONTRAST_COLUMNS + OFFSET_COLUMNS))),
        LegendreSum(baseline, rng.normal(size=(len(baseline), RESPONSE_COLUMNS))),
    )


def samples_of(surrogate: PressSurrogate, count: int, seed: int) -> PressSamples:
    parameters = draw_parameters(count, np.random.default_rng(seed))
    return PressSamples(parameters, surrogate.rows(normalise(parameters)), np.zeros((count, SECOND_COLUMNS)))


def test_a_polynomial_surrogate_is_recovered_from_its_own_rows(truth):
    found = fit_surrogate(samples_of(truth, 300, seed=2))
    np.testing.assert_array_equal(found.inclusion_field.degrees, truth.inclusion_field.degrees)
    np.testing.assert_allclose(found.inclusion_field.coefficients, truth.inclusion_field.coefficients, atol=1e-9)
    np.testing.assert_allclose(found.baseline.coefficients, truth.baseline.coefficients, atol=1e-9)


def test_the_error_on_presses_kept_apart_is_that_of_the_rows(truth):
    found, apart = fit_surrogate(samples_of(truth, 300, seed=2)), samples_of(truth, 50, seed=3)
    assert held_out_error(found, apart).max() < 1e-9
    apart.rows[:, 7] += 0.01
    assert held_out_error(found, apart)[7] == pytest.approx(0.01, rel=1e-6)
    assert np.delete(held_out_error(found, apart), 7).max() < 1e-9


def test_noise_in_rows_is_averaged_over_presses_and_not_followed(truth):
    samples, std = samples_of(truth, 600, seed=2), 1e-3
    noisy = replace(samples, rows=samples.rows + np.random.default_rng(4).normal(0, std, samples.rows.shape))
    error = held_out_error(fit_surrogate(noisy), samples)
    expected = std * np.sqrt(len(truth.inclusion_field.degrees) / 600)
    assert np.mean(error[:CONTRAST_COLUMNS]) == pytest.approx(expected, rel=0.1)


def test_terms_are_all_below_a_total_degree_when_every_parameter_reaches_as_far():
    """There are (9 + n over n) products of nine polynomials up to a total degree n."""
    for reach in (1, 2, 3):
        found = degrees(dict.fromkeys(PARAMETERS, float(reach)), {})
        assert len(found) == len(np.unique(found, axis=0)) == math.comb(9 + reach, reach)
        assert found.sum(axis=1).max() == reach


def test_terms_are_bounded_by_their_reach_together_and_by_their_highest_degree():
    found = degrees(NONE | {"size_mm": 4.0, "depth_mm": 2.0}, {"size_mm": 3})
    assert {tuple(row[:2]) for row in found.tolist()} == {
        (0, 0),
        (1, 0),
        (2, 0),
        (3, 0),
        (0, 1),
        (1, 1),
        (2, 1),
        (0, 2),
    }
    assert not found[:, 2:].any()


def test_too_few_presses_are_refused_by_name(truth):
    enough = 3 * len(truth.inclusion_field.degrees)
    fit_surrogate(samples_of(truth, enough, seed=2))
    with pytest.raises(InvalidQuantity, match=f"^presses is {enough - 1}, but must be at least {enough} presses"):
        fit_surrogate(samples_of(truth, enough - 1, seed=2))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_presses_that_are_not_finite_are_refused_and_counted(truth, value):
    samples = samples_of(truth, 300, seed=2)
    samples.rows[[4, 17], [3, 60]] = value
    with pytest.raises(InvalidQuantity, match="^presses that are not finite is 2, .* leave them out"):
        fit_surrogate(samples)
