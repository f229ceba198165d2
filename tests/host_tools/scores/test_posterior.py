"""The reference sampler on a linear forward model with Gaussian noise, whose posterior is known on paper."""

from __future__ import annotations

import numpy as np
import pytest
from linear_press import STD, TRUTH, noisy_row, on_paper, random_slopes
from small_surrogate import linear_surrogate, white_noise

from device.measurement.parameters import EVEN_STD, PARAMETERS
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.surrogate import MODULUS
from host_tools.scores import posterior as mode_posterior
from host_tools.scores.posterior import OneScene, Sampled, posterior_chapter, sampled

STEPS, BURN_IN = 1200, 400


@pytest.fixture(scope="module")
def slopes() -> np.ndarray:
    return random_slopes()


@pytest.fixture(scope="module")
def row(slopes) -> np.ndarray:
    return noisy_row(slopes)


@pytest.fixture(scope="module")
def short():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mode_posterior, "STEPS", STEPS)
        patch.setattr(mode_posterior, "BURN_IN", BURN_IN)
        yield


@pytest.fixture(scope="module")
def found(short, row, slopes) -> Sampled:
    return sampled(PressPosterior(row, linear_surrogate(slopes), white_noise(STD)), TRUTH, 1)


def test_mean_and_spread_are_those_of_linear_algebra(found, row, slopes):
    """The ends of the ranges are far away; chance is that of the steps over their autocorrelation."""
    mean, covariance = on_paper(row, slopes)
    std = np.sqrt(np.diag(covariance))
    chance = np.sqrt(found.autocorrelation / (STEPS * mode_posterior.WALKERS))
    assert chance < 0.1
    assert np.abs((found.mean[:2] - mean[:2]) / std[:2]).max() < 5 * chance
    np.testing.assert_allclose(found.std[:2], std[:2], rtol=5 * chance)


def test_what_the_row_does_not_tell_keeps_its_even_prior(found):
    """Walkers that begin within a fifth of the truth find the whole range."""
    assert found.mean[MODULUS] == pytest.approx(0.0, abs=0.1)
    assert found.std[MODULUS] == pytest.approx(EVEN_STD, rel=0.1)


def test_the_autocorrelation_is_far_shorter_than_the_chain(found):
    assert 10 < found.autocorrelation < STEPS / 5


def test_the_same_seed_gives_the_same_sample_and_another_one_another(row, slopes, monkeypatch):
    monkeypatch.setattr(mode_posterior, "STEPS", 20)
    monkeypatch.setattr(mode_posterior, "BURN_IN", 5)
    posterior = PressPosterior(row, linear_surrogate(slopes), white_noise(STD))
    first, again, other = (sampled(posterior, TRUTH, seed) for seed in (2, 2, 3))
    np.testing.assert_array_equal(first.mean, again.mean)
    np.testing.assert_array_equal(first.std, again.std)
    assert (first.mean != other.mean).all()


def test_a_truth_at_the_end_of_its_range_is_begun_inside_it(slopes, monkeypatch):
    """Outside the posterior is nothing, and a walker that began there might never move."""
    monkeypatch.setattr(mode_posterior, "STEPS", 200)
    monkeypatch.setattr(mode_posterior, "BURN_IN", 100)
    at_end = np.where(np.arange(len(PARAMETERS)) == 0, 1.0, TRUTH)
    row = linear_surrogate(slopes).rows(at_end[None])[0]
    found = sampled(PressPosterior(row, linear_surrogate(slopes), white_noise(STD)), at_end, 4)
    assert 0.9 < found.mean[0] < 1
    assert np.isfinite(found.std).all()


def test_the_chapter_sets_a_mode_that_is_asked_for_over_the_posterior_and_its_spread(monkeypatch):
    """Errors of 0.3 where the posterior's mean errs by 0.2 and says 0.25: 1.5 of the mean's, 1.2 of the bound."""
    asked = []

    def compared(model, mode, *, seed, scenes, jobs):
        asked.append((mode, scenes))
        truth, alike = np.zeros(3), np.ones(3)
        return [
            OneScene(truth, Sampled(0.2 * alike, 0.25 * alike, 40.0), sign * 0.3 * alike, alike) for sign in (-1, 1)
        ]

    monkeypatch.setattr(mode_posterior, "compared", compared)
    chapter = posterior_chapter(None, modes=("standard",), scenes=2)
    assert asked == [("standard", 2)]
    assert [one.error for one in chapter.benchmarks] == pytest.approx([1.5] * 3)
    assert chapter.tables[0].rows[0] == ("standard, size_mm", "0.3000", "0.2000", "0.2500", "1.20")


def test_one_scene_is_no_comparison():
    with pytest.raises(InvalidQuantity, match="scenes is 1, but must be at least 2"):
        posterior_chapter(None, scenes=1)
