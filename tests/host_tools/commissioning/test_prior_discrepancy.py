"""What may be lacking before any phantom, and ramps that share it, against answers on paper."""

import numpy as np
import pytest

from device.measurement.ramp_modes.commissioned.discrepancy import NOTHING, PARTS
from device.measurement.ramp_modes.radial_profile import COLUMNS, CONTRAST, RESPONSE
from host_tools.commissioning.prior_discrepancy import BY_SKIN_RATIO, GROWTH, SharedLack, prior_discrepancy


def test_a_prior_has_the_size_that_was_asked_for_in_every_part():
    std = np.linalg.norm(prior_discrepancy(0.1).factor, axis=2)
    assert std[0, CONTRAST] == pytest.approx(0.1, rel=1e-6)
    assert std[0, RESPONSE] == pytest.approx(0.1 * GROWTH, rel=1e-6)
    assert std[1:] == pytest.approx(np.tile(BY_SKIN_RATIO * std[0], (PARTS - 1, 1)))
    assert prior_discrepancy(0.1).factor.shape == (PARTS, COLUMNS, PARTS * COLUMNS)


def test_where_nothing_is_lacking_there_is_no_discrepancy():
    assert prior_discrepancy(0.0) is NOTHING


def test_rings_beside_each_other_are_wrong_together_and_distant_ones_apart():
    factor = prior_discrepancy(0.1).factor[0]
    correlation = (factor @ factor.T)[CONTRAST, CONTRAST][0] / 0.1**2
    assert correlation[1] > 0.9  # the next ring, 0.9 mm away
    assert correlation[10] < 0.01  # 9 mm away


@pytest.mark.parametrize("rank", [0, 2])
def test_ramps_that_share_what_is_lacking_are_white_together(rank):
    """Their covariance is 1 + L L^T; the mean is that of Bayesian least squares."""
    rng = np.random.default_rng(2)
    lack, left = rng.standard_normal((5, rank)), rng.standard_normal(5)
    shared, covariance = SharedLack(lack), np.eye(5) + lack @ lack.T
    whitening = shared.whitened(np.eye(5))
    assert whitening @ covariance @ whitening.T == pytest.approx(np.eye(5), abs=1e-12)
    assert shared.log_volume == pytest.approx(-0.5 * np.linalg.slogdet(covariance)[1])
    if rank:
        assert shared.mean(left) == pytest.approx(-np.linalg.solve(lack.T @ lack + np.eye(rank), lack.T @ left))
