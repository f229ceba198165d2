"""The posterior of a linear forward model with Gaussian noise is known on paper; nothing here is a real press."""

from collections.abc import Iterator

import numpy as np
import pytest
from linear_press import NOISE, START, TOLD, TRUTH, noisy_row, on_paper, random_slopes
from small_surrogate import COLUMNS, linear_surrogate, white_noise

from device.measurement.parameters import EVEN_STD, PARAMETERS, is_possible, normalise
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.posterior import (
    ENOUGH_EFFECTIVE,
    FEWEST_EFFECTIVE,
    MOST_SPOTS,
    SAMPLES,
    PressFit,
    best_everywhere,
    sample_press,
    weighted_samples,
)
from device.measurement.ramp_modes.surrogate import MODULUS, TISSUE
from host_tools.press_models.press_samples import draw_parameters


@pytest.fixture(scope="module", autouse=True)
def box() -> Iterator[None]:
    """The ranges without what is impossible in them: a box, of which all is known on paper."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("device.measurement.ramp_modes.fit.is_possible", lambda values: np.full(len(values), True))
        yield


@pytest.fixture(scope="module")
def slopes() -> np.ndarray:
    return random_slopes()


@pytest.fixture(scope="module")
def row(slopes) -> np.ndarray:
    return noisy_row(slopes)


@pytest.fixture(scope="module")
def fit(row, slopes) -> PressFit:
    return sample_press(PressPosterior(row, linear_surrogate(slopes), NOISE), START)


def test_the_posterior_of_a_linear_model_is_the_gaussian_of_linear_algebra(fit, row, slopes):
    mean, covariance = on_paper(row, slopes)
    spread = np.sqrt(np.diag(covariance))
    assert (np.abs(mean) + 4 * spread < 1).all()
    np.testing.assert_allclose(fit.spread[TOLD], spread, rtol=0.05)
    assert np.abs((fit.mean[TOLD] - mean) / spread).max() < 5 / np.sqrt(fit.effective_samples)


def test_what_the_row_does_not_tell_keeps_the_spread_of_its_even_prior(fit):
    assert fit.spread[MODULUS] == pytest.approx(EVEN_STD, rel=0.05)
    assert fit.mean[MODULUS] == pytest.approx(0.0, abs=5 * EVEN_STD / np.sqrt(fit.effective_samples))


def test_the_samples_are_worth_enough(fit):
    assert ENOUGH_EFFECTIVE <= fit.effective_samples <= SAMPLES  # of a Gaussian the first ones are enough


def test_the_same_row_twice_gives_the_same_answer(fit, row, slopes):
    again = sample_press(PressPosterior(row, linear_surrogate(slopes), NOISE), START)
    np.testing.assert_array_equal(again.mean, fit.mean)
    np.testing.assert_array_equal(again.spread, fit.spread)


def test_a_parameter_at_the_end_of_its_range_is_not_estimated_beyond_it(slopes):
    truth = TRUTH.copy()
    truth[0] = 1.0
    row = linear_surrogate(slopes).rows(truth[None])[0]
    fit = sample_press(PressPosterior(row, linear_surrogate(slopes), NOISE), START)
    mean, covariance = on_paper(row, slopes)
    assert mean[0] == pytest.approx(1.0)
    spread = np.sqrt(covariance[0, 0])
    assert fit.mean[0] == pytest.approx(1 - spread * np.sqrt(2 / np.pi), abs=0.1 * spread)
    assert fit.spread[0] == pytest.approx(spread * np.sqrt(1 - 2 / np.pi), rel=0.1)


def test_a_start_outside_the_ranges_is_brought_inside(fit, row, slopes):
    outside = sample_press(PressPosterior(row, linear_surrogate(slopes), NOISE), np.full(len(PARAMETERS), 1.7))
    np.testing.assert_allclose(outside.best, fit.best, atol=1e-3)


def test_a_row_that_drives_the_fit_into_a_corner_tells_nothing_and_is_never_not_a_number(slopes):
    """Coordinates of 40 in all that shows: no sample has a density that counts, or only a few have."""
    row = linear_surrogate(slopes).rows(40 * np.sign(TRUTH)[None])[0]
    fit = sample_press(PressPosterior(row, linear_surrogate(slopes), NOISE), START)
    assert fit.effective_samples < FEWEST_EFFECTIVE
    np.testing.assert_array_equal(fit.spread, EVEN_STD)
    np.testing.assert_array_equal(fit.mean, fit.best)


@pytest.mark.parametrize("inside", [0, 1])
def test_samples_that_all_miss_the_ranges_but_for_one_tell_nothing(inside, row, slopes, monkeypatch):
    posterior = PressPosterior(row, linear_surrogate(slopes), NOISE)
    density = posterior.log_density

    def of_few(normalised: np.ndarray) -> np.ndarray:
        return (
            np.where(np.arange(len(normalised)) < inside, density(normalised), -np.inf)
            if len(normalised) > 1
            else density(normalised)
        )

    monkeypatch.setattr(posterior, "log_density", of_few)
    fit = sample_press(posterior, START)
    assert fit.effective_samples <= inside * (1 + MOST_SPOTS)
    np.testing.assert_array_equal(fit.spread, EVEN_STD)


class BentRows:
    """A forward model whose first column is x0 + 1.5 x1^2, of the first two coordinates; nothing else shows."""

    to_mm = 2.0

    def rows(self, normalised: np.ndarray, direction_rad: np.ndarray | None = None) -> np.ndarray:
        rows = np.zeros((len(normalised), COLUMNS))
        rows[:, 0] = normalised[:, 0] + 1.5 * normalised[:, 1] ** 2
        return rows

    def rows_and_jacobian(
        self, normalised: np.ndarray, direction_rad: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        slopes = np.zeros((len(normalised), COLUMNS, len(PARAMETERS)))
        slopes[:, 0, 0], slopes[:, 0, 1] = 1.0, 3.0 * normalised[:, 1]
        return self.rows(normalised), slopes


def test_a_bent_posterior_gets_more_gaussians_and_comes_nearer_to_its_integral(monkeypatch):
    """Along x1 the posterior is even wherever x0 = 0.3 - 1.5 x1^2 lies in its range; six other coordinates are free."""
    row = np.zeros(COLUMNS)
    row[0] = 0.3
    posterior, start = PressPosterior(row, BentRows(), white_noise(0.05)), np.zeros(len(PARAMETERS))
    bent = sample_press(posterior, start)
    monkeypatch.setattr("device.measurement.ramp_modes.posterior.MOST_SPOTS", 0)
    straight = sample_press(posterior, start)
    assert straight.effective_samples < ENOUGH_EFFECTIVE / 2 < ENOUGH_EFFECTIVE <= bent.effective_samples
    x1 = np.linspace(-1, 1, 20_001)
    x0 = 0.3 - 1.5 * x1**2
    x0, x1 = x0[np.abs(x0) <= 1], x1[np.abs(x0) <= 1]
    for moment, exact in (("mean", (x0.mean(), 0.0)), ("spread", (x0.std(), x1.std()))):
        errors = [np.abs(getattr(fit, moment)[:2] - exact) for fit in (bent, straight)]
        assert errors[0][0] < 0.5 * errors[1][0]
    assert bent.spread[1] > 1.5 * straight.spread[1]


def test_a_press_that_tells_nothing_leaves_what_is_possible_and_no_more(monkeypatch):
    """Means, spreads, and how modulus and tissue hang together: those of parameters that are drawn."""
    monkeypatch.setattr("device.measurement.ramp_modes.fit.is_possible", is_possible)
    monkeypatch.setattr("device.measurement.ramp_modes.posterior.SAMPLES", 40_000)
    nothing = linear_surrogate(np.zeros_like(random_slopes()))
    posterior = PressPosterior(nothing.rows(np.zeros((1, len(PARAMETERS))))[0], nothing, NOISE)
    _, in_cells, others = best_everywhere(posterior, START)
    at, weight, effective = weighted_samples(posterior, in_cells, others)
    drawn, error = normalise(draw_parameters(20_000, np.random.default_rng(1))), 4 * EVEN_STD / np.sqrt(effective)
    mean = weight @ at
    np.testing.assert_allclose(mean, drawn.mean(axis=0), atol=error)
    np.testing.assert_allclose(np.sqrt(weight @ (at - mean) ** 2), drawn.std(axis=0), atol=error)
    together = drawn[:, MODULUS] @ drawn[:, TISSUE] / len(drawn)
    assert weight @ (at[:, MODULUS] * at[:, TISSUE]) == pytest.approx(together, abs=error * EVEN_STD)
    assert together > 1.5 * error * EVEN_STD
