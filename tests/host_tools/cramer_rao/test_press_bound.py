"""The bound of a press on surrogates whose rows are known on paper."""

from __future__ import annotations

import numpy as np
import pytest
from linear_press import TOLD, random_slopes
from small_surrogate import linear_surrogate, random_surrogate, white_noise

from device.measurement.parameters import EVEN_STD, HIGH, LOW, PARAMETERS
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.surrogate import MODULUS
from host_tools.cramer_rao.press_bound import least_errors

TRUTH = Inclusion(9.0, 7.0, 60.0)
STD = 0.05


@pytest.fixture
def linear() -> RampAnswers:
    """The reference response is linear in all coordinates but the modulus, which shows in nothing."""
    return RampAnswers(linear_surrogate(random_slopes()), white_noise(STD))


def test_of_a_linear_press_it_is_the_posterior_of_gaussian_noise_and_prior(linear):
    slopes = random_slopes()[TOLD]
    posterior = np.linalg.inv(slopes @ slopes.T / STD**2 + np.eye(8) / EVEN_STD**2)
    np.testing.assert_allclose(least_errors(linear, "standard", TRUTH)[:2], np.sqrt(np.diag(posterior))[:2], rtol=1e-9)


def test_what_the_press_does_not_tell_is_known_by_the_box_alone(linear):
    assert least_errors(linear, "standard", TRUTH)[MODULUS] == pytest.approx(EVEN_STD)


def test_half_the_noise_leaves_about_half_the_errors(linear):
    fine = RampAnswers(linear.surrogate, white_noise(STD / 2))
    assert (least_errors(fine, "standard", TRUTH)[:2] < 0.6 * least_errors(linear, "standard", TRUTH)[:2]).all()


def test_nuisances_that_are_told_move_the_press_and_others_are_nominal():
    answers = RampAnswers(random_surrogate(), white_noise(1e-3))
    nominal, told = least_errors(answers, "standard", TRUTH), least_errors(answers, "standard", TRUTH, {"albedo": 0.42})
    again = least_errors(answers, "standard", TRUTH, {"albedo": 0.5})
    np.testing.assert_array_equal(nominal, again)
    assert np.abs(told / nominal - 1).max() > 0.01


@pytest.mark.parametrize("mode", ["quick", "precise", "paper"])
def test_a_mode_that_is_not_of_one_ramp_has_no_bound(linear, mode):
    assert np.isnan(least_errors(linear, mode, TRUTH)).all()


def test_it_holds_at_the_ends_of_the_trained_ranges_and_not_beyond(linear):
    for end in (LOW, HIGH):
        at = dict(zip(PARAMETERS, end, strict=True))
        assert np.isfinite(least_errors(linear, "standard", Inclusion(*end[:3]), at)).all()
    assert np.isnan(least_errors(linear, "standard", Inclusion(15.1, 7.0, 60.0))).all()
    assert np.isnan(least_errors(linear, "standard", TRUTH, {"slab_thickness_mm": 61.0})).all()


def test_estimates_that_know_the_box_reach_it_and_no_better(linear):
    """Bayes' rule on presses drawn from prior and noise, all Gaussian: errors as large as the bound, by chance 2 %."""
    rng, slopes = np.random.default_rng(8), random_slopes()[TOLD]
    truth = rng.normal(0, EVEN_STD, (4000, 8))
    rows = truth @ slopes + rng.normal(0, STD, (4000, slopes.shape[1]))
    covariance = np.linalg.inv(slopes @ slopes.T / STD**2 + np.eye(8) / EVEN_STD**2)
    errors = rows @ slopes.T @ covariance / STD**2 - truth
    np.testing.assert_allclose(
        np.sqrt(np.mean(errors**2, axis=0))[:2], least_errors(linear, "standard", TRUTH)[:2], rtol=0.05
    )
