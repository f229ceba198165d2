"""Second harmonics of round inclusions, polynomials times a factor, are recovered from their own values."""

from dataclasses import replace

import numpy as np
import pytest
from small_surrogate import COLUMNS, random_surrogate

from device.measurement.parameters import PARAMETERS, normalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.ellipticity import SECOND_COLUMNS, EllipticityTest
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.surrogate import OFFSET
from host_tools.press_models import fit_surrogate as module
from host_tools.press_models.fit_surrogate import degrees, fit_second_harmonics, held_out_second_harmonics
from host_tools.press_models.press_samples import PressSamples, draw_parameters

SMALL = dict.fromkeys(PARAMETERS, 1.0) | {"size_mm": 3.0, "depth_mm": 2.0}
HIGHEST = {"size_mm": 2}


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Thirteen terms instead of hundreds."""
    monkeypatch.setattr(module, "SECOND_REACH", SMALL)
    monkeypatch.setattr(module, "SECOND_HIGHEST", HIGHEST)


@pytest.fixture
def truth() -> EllipticityTest:
    terms = degrees(SMALL, HIGHEST)
    coefficients = np.random.default_rng(1).normal(size=(len(terms), SECOND_COLUMNS))
    return ellipticity(LegendreSum(terms, coefficients))


def ellipticity(second: LegendreSum) -> EllipticityTest:
    return EllipticityTest(random_surrogate(), second, {})


def samples_of(spot: EllipticityTest, count: int, seed: int) -> PressSamples:
    parameters = draw_parameters(count, np.random.default_rng(seed))
    return PressSamples(parameters, np.zeros((count, COLUMNS)), spot.second_harmonics(normalise(parameters)))


def test_polynomials_are_recovered_from_their_own_values(truth):
    found = fit_second_harmonics(samples_of(truth, 300, seed=2))
    np.testing.assert_array_equal(found.degrees, truth.second.degrees)
    np.testing.assert_allclose(found.coefficients, truth.second.coefficients, atol=1e-9)


def test_the_error_on_presses_kept_apart_is_that_of_the_values(truth):
    found = ellipticity(fit_second_harmonics(samples_of(truth, 300, seed=2)))
    apart = samples_of(truth, 50, seed=3)
    assert held_out_second_harmonics(found, apart).max() < 1e-9
    apart.second_harmonics[:25, 7] += 0.01
    apart.second_harmonics[25:, 7] -= 0.01
    error = held_out_second_harmonics(found, apart)
    assert error.shape == (SECOND_COLUMNS,)
    assert error[7] == pytest.approx(0.01, rel=1e-6)
    assert np.delete(error, 7).max() < 1e-9


def test_noise_is_averaged_over_presses_and_not_followed(truth):
    """Least squares of M terms to n presses leave sqrt(M / n) of it, in the values' own unit."""
    samples, std = samples_of(truth, 600, seed=2), 1e-3
    noise = np.random.default_rng(4).normal(0, std, samples.second_harmonics.shape)
    noisy = replace(samples, second_harmonics=samples.second_harmonics + noise)
    error = held_out_second_harmonics(ellipticity(fit_second_harmonics(noisy)), samples)
    assert np.mean(error) == pytest.approx(std * np.sqrt(len(truth.second.degrees) / 600), rel=0.1)


def test_an_inclusion_on_the_axis_keeps_no_second_harmonic_whatever_the_noise(truth):
    samples = samples_of(truth, 300, seed=2)
    samples.second_harmonics[:] += 0.01
    found = ellipticity(fit_second_harmonics(samples))
    normalised = normalise(samples.parameters[:5])
    normalised[:, OFFSET] = -1.0
    np.testing.assert_array_equal(found.second_harmonics(normalised), 0.0)


def test_too_few_presses_are_refused_by_name(truth):
    enough = 3 * len(truth.second.degrees)
    assert len(fit_second_harmonics(samples_of(truth, enough, seed=2)).degrees) == enough / 3
    with pytest.raises(InvalidQuantity, match=f"^presses is {enough - 1}, but must be at least {enough} presses"):
        fit_second_harmonics(samples_of(truth, enough - 1, seed=2))
