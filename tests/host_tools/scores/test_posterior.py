"""The reference sampler on a linear forward model with Gaussian noise, whose posterior is known on paper."""

from __future__ import annotations

from types import SimpleNamespace

import emcee
import numpy as np
import pytest
from linear_press import STD, TRUTH, noisy_row, on_paper, random_slopes
from small_surrogate import COLUMNS, LinearRows, linear_surrogate, white_noise

from device.measurement.parameters import EVEN_STD, PARAMETERS
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.radial_profile import FIRST
from device.measurement.ramp_modes.surrogate import MODULUS, TISSUE
from host_tools.scores import posterior as mode_posterior
from host_tools.scores.posterior import OneScene, Sampled, posterior_chapter, sampled, split_r_hat

STEPS, BURN_IN = 600, 400
APART = np.array([TRUTH, np.zeros(len(PARAMETERS))])


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
    return sampled(PressPosterior(row, linear_surrogate(slopes), white_noise(STD)), APART, 1)


def test_mean_and_spread_are_those_of_linear_algebra(found, row, slopes):
    """The ends of the ranges are far away; chance is that of the steps over their autocorrelation."""
    mean, covariance = on_paper(row, slopes)
    std = np.sqrt(np.diag(covariance))
    chance = 1 / np.sqrt(found.effective_samples)
    assert chance < 0.1
    assert np.abs((found.mean[:2] - mean[:2]) / std[:2]).max() < 5 * chance
    np.testing.assert_allclose(found.std[:2], std[:2], rtol=5 * chance)


def test_what_the_row_does_not_tell_keeps_its_even_prior(found):
    """Walkers that begin within a fifth of a place find the whole range."""
    assert found.mean[MODULUS] == pytest.approx(0.0, abs=0.1)
    assert found.std[MODULUS] == pytest.approx(EVEN_STD, rel=0.1)


def test_the_chains_are_worth_far_fewer_samples_than_they_hold(found):
    """Autocorrelation times are tens of steps, and each run is many of them long."""
    drawn = len(APART) * STEPS * mode_posterior.WALKERS
    assert 10 < drawn / found.effective_samples < STEPS / 5


def test_runs_that_began_apart_agree(found):
    """Chance alone: 1 + half the variance of means of some hundred effective samples a half."""
    assert 1.0 < found.r_hat < 1.03


def test_the_moves_keep_the_spread_of_a_gaussian():
    """Of nine dimensions; a tenth of emcee's snooker moves among them leaves 0.983 of it."""
    sampler = emcee.EnsembleSampler(
        mode_posterior.WALKERS,
        9,
        lambda at: -0.5 * np.sum(at**2, axis=1),
        vectorize=True,
        moves=[*mode_posterior.MOVES],
    )
    sampler.random_state = np.random.RandomState(1).get_state()
    sampler.run_mcmc(np.random.default_rng(1).standard_normal((mode_posterior.WALKERS, 9)), 12_000)
    assert sampler.get_chain(flat=True, discard=500).std(axis=0).mean() == pytest.approx(1.0, abs=0.005)


def test_r_hat_of_equal_halves_is_nearly_1_and_of_a_moved_run_what_its_distance_makes():
    """Means of four halves at 0, 0, 2 and 2, each of variance 1: 1 + 4 / 3."""
    rng = np.random.default_rng(4)
    chains = rng.standard_normal((2, 20_000, 2, 3))
    assert split_r_hat(chains) == pytest.approx(1.0, abs=1e-3)
    chains[1, ..., 2] += 2.0
    assert split_r_hat(chains) == pytest.approx(np.sqrt(1 + 4 / 3), rel=0.01)


def test_r_hat_notes_a_run_that_drifts():
    """Halves of one run at -1 and 1, twice: as far apart as two runs at -1 and 1."""
    chain = np.random.default_rng(4).standard_normal((10_000, 2, 1)) + np.repeat([-1.0, 1.0], 5_000)[:, None, None]
    assert split_r_hat([chain, chain]) == pytest.approx(np.sqrt(1 + 4 / 3), rel=0.03)


def test_the_same_seed_gives_the_same_sample_and_another_one_another(row, slopes, monkeypatch):
    monkeypatch.setattr(mode_posterior, "STEPS", 100)
    monkeypatch.setattr(mode_posterior, "LONGER", 1)
    monkeypatch.setattr(mode_posterior, "BURN_IN", 5)
    posterior = PressPosterior(row, linear_surrogate(slopes), white_noise(STD))
    first, again, other = (sampled(posterior, APART, seed) for seed in (2, 2, 3))
    np.testing.assert_array_equal(first.mean, again.mean)
    np.testing.assert_array_equal(first.std, again.std)
    assert (first.mean != other.mean).all()


def test_a_truth_at_the_end_of_its_range_is_begun_inside_it(slopes, monkeypatch):
    """Outside the posterior is nothing, and a walker that began there might never move."""
    monkeypatch.setattr(mode_posterior, "STEPS", 200)
    monkeypatch.setattr(mode_posterior, "BURN_IN", 100)
    at_end = np.where(np.arange(len(PARAMETERS)) == 0, 1.0, TRUTH)
    row = linear_surrogate(slopes).rows(at_end[None])[0]
    found = sampled(PressPosterior(row, linear_surrogate(slopes), white_noise(STD)), at_end[None], 4)
    assert 0.9 < found.mean[0] < 1
    assert np.isfinite(found.std).all()


def test_walkers_begin_where_something_is_possible_however_far_away(row, slopes):
    """An inclusion of 10 kPa in tissue of 30 kPa is not."""
    posterior, impossible = PressPosterior(row, linear_surrogate(slopes), white_noise(STD)), np.zeros(len(PARAMETERS))
    impossible[[MODULUS, TISSUE]] = -1.0, 1.0
    begun = mode_posterior._begun(posterior, impossible, np.random.default_rng(3))
    assert len(begun) == mode_posterior.WALKERS
    assert np.isfinite(posterior.log_density(begun)).all()


class TwoHollows:
    """A Gaussian of `STD` at 0.5, and one at -0.5 that is less likely by a factor e^`less`."""

    STD = 0.05

    def __init__(self, less):
        self.less = less

    def log_density(self, at):
        near, far = (np.sum(((at + place) / self.STD) ** 2, axis=1) / 2 for place in (-0.5, 0.5))
        return np.where(np.abs(at).max(axis=1) < 1, np.logaddexp(-near, -far - self.less), -np.inf)


@pytest.fixture
def short_runs(monkeypatch):
    monkeypatch.setattr(mode_posterior, "STEPS", 400)
    monkeypatch.setattr(mode_posterior, "BURN_IN", 400)


@pytest.mark.parametrize("near", [0.0, -0.15])
def test_walkers_in_a_hollow_that_counts_for_nothing_are_begun_again(near, short_runs, monkeypatch):
    """Of 48 begun evenly about the middle some end there, of those begun nearer to it all but a few."""
    monkeypatch.setattr(mode_posterior, "AROUND", 0.5)
    found = sampled(TwoHollows(30.0), np.full((2, len(PARAMETERS)), near), 3)
    assert found.mean == pytest.approx(0.5, abs=0.01)
    assert found.std == pytest.approx(TwoHollows.STD, abs=0.01)
    assert found.lost == 0


def test_without_that_they_stay_lost_and_are_counted(short_runs, monkeypatch):
    monkeypatch.setattr(mode_posterior, "AROUND", 0.5)
    monkeypatch.setattr(mode_posterior, "_begun_again", lambda at, lost, rng: at)
    found = sampled(TwoHollows(30.0), np.zeros((2, len(PARAMETERS))), 3)
    assert found.lost > 0
    assert found.std.min() > 0.1


def test_a_hollow_that_counts_is_kept_and_runs_that_do_not_agree_are_longer(short_runs, monkeypatch):
    """As likely as the other, and too far for any walker to change: each run has as many in it as began there."""
    monkeypatch.setattr(mode_posterior, "LONGER", 2)
    found = sampled(TwoHollows(0.0), np.array([[0.5], [-0.5]]) * np.ones(len(PARAMETERS)), 3)
    assert found.longer == 2
    assert found.r_hat > 2
    assert found.lost == 0
    assert found.mean == pytest.approx(0.0, abs=0.05)


def test_mode_and_reference_are_told_the_direction_of_each_press(monkeypatch):
    """What a direction adds is twice the light: neither errs by more than its own spread says."""
    slopes, along = np.random.default_rng(5).normal(0.0, 0.15, (len(PARAMETERS), COLUMNS)), np.zeros(COLUMNS)
    along[FIRST] = 2.0
    answers = RampAnswers(LinearRows(slopes, along), white_noise(STD))
    model = SimpleNamespace(answers=answers, first_guesses=lambda rows: np.zeros((len(rows), 3)))
    posteriors = []

    def reference(posterior, near, seed):
        truth, mean = near
        posteriors.append(np.mean(posterior.residuals(truth) ** 2))
        assert np.sum(posterior.residuals(mean) ** 2) < np.sum(posterior.residuals(truth) ** 2)
        return Sampled(truth[:3], np.ones(3), 1.0, 1.0)

    monkeypatch.setattr(mode_posterior, "sampled", reference)
    found = mode_posterior.compared(model, seed=3, scenes=4, jobs=1)
    assert np.mean(posteriors) == pytest.approx(1.0, abs=0.25)  # of 4 x 153 columns
    for one in found:
        assert np.abs((one.mean - one.truth) / one.spread).max() < 5


def test_the_chapter_sets_the_mode_over_the_posterior_and_its_spread(monkeypatch):
    """Errors of 0.3 where the posterior's mean errs by 0.2 and says 0.25: 1.5 of the mean's, 1.2 of the bound."""
    asked = []

    def compared(model, *, seed, scenes, jobs):
        asked.append(scenes)
        truth, alike = np.zeros(3), np.ones(3)
        return [
            OneScene(
                truth,
                Sampled(
                    0.2 * alike, 0.25 * alike, 500.0 + 100 * sign, 1.02 + 0.02 * sign, *((1, 8) if sign < 0 else ())
                ),
                sign * 0.3 * alike,
                alike,
            )
            for sign, more in ((-1, (1, 8)), (1, ()))
        ]

    monkeypatch.setattr(mode_posterior, "compared", compared)
    chapter = posterior_chapter(None, scenes=2)
    assert asked == [2]
    assert [one.error for one in chapter.benchmarks[:3]] == pytest.approx([1.5] * 3)
    assert [one.measured for one in chapter.benchmarks[3:]] == [1.02, pytest.approx(1.04), 400.0, 1.0]
    assert [one.passed for one in chapter.benchmarks[3:]] == [False, True, True, False]
    assert "of 1 presses, whose runs did not agree, 8 times as long" in chapter.claim
    errors, alike = chapter.tables
    assert alike.rows[0] == ("size_mm", "1.200", "1.840", "4.000", "4.000", "4.000")
    assert errors.rows[0] == ("size_mm", "0.3000", "0.2000", "0.2500", "1.20", "1.50", "0.00")


def test_the_chance_of_a_ratio_of_errors_is_that_of_many_sets_of_presses():
    """Errors of one and twice the size that hang together: of 4000 sets of 100 presses each."""
    rng = np.random.default_rng(7)
    draw = rng.standard_normal((4000, 100, 2)) @ np.array([[1.0, 0.6], [0.0, 0.8]])
    ratios = np.sqrt(np.mean((2 * draw[..., 0]) ** 2, axis=1) / np.mean(draw[..., 1] ** 2, axis=1))
    told = [mode_posterior.standard_error(2 * one[:, :1], one[:, 1:])[0] for one in draw[:40]]
    assert np.mean(told) == pytest.approx(ratios.std(), rel=0.1)


def test_one_scene_is_no_comparison():
    with pytest.raises(InvalidQuantity, match="scenes is 1, but must be at least 2"):
        posterior_chapter(None, scenes=1)
