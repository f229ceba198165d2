"""Bounds of linear measurements that are known on paper."""

import numpy as np
import pytest

from host_tools.cramer_rao.information import cramer_rao, with_nuisances


@pytest.fixture
def rng():
    return np.random.default_rng(3)


@pytest.fixture
def jacobian(rng):
    return rng.standard_normal((40, 3))


def test_the_bound_under_equal_noise_is_the_covariance_of_least_squares(jacobian):
    found = cramer_rao(jacobian, 0.04 * np.eye(40))
    covariance = 0.04 * np.linalg.inv(jacobian.T @ jacobian)
    assert found.std == pytest.approx(np.sqrt(np.diag(covariance)))
    assert found.correlation == pytest.approx(covariance / np.outer(found.std, found.std))


def test_least_squares_reach_the_bound(rng, jacobian):
    covariance = np.diag(rng.uniform(0.5, 2.0, 40))
    root = np.linalg.cholesky(covariance)
    weighted = np.linalg.pinv(np.linalg.solve(root, jacobian))
    estimates = weighted @ rng.standard_normal((40, 20_000))
    assert estimates.std(axis=1) == pytest.approx(cramer_rao(jacobian, covariance).std, rel=0.03)


def test_nuisances_as_noise_are_nuisances_estimated_too(rng, jacobian):
    """The Schur complement of the joint information, with the nuisances' spreads as prior."""
    nuisances, spread = rng.standard_normal((40, 2)), np.array([0.3, 2.0])
    white = 0.01 * np.eye(40)
    both = np.hstack([jacobian, nuisances])
    joint = both.T @ both / 0.01 + np.diag([0, 0, 0, *(1 / spread**2)])
    found = cramer_rao(jacobian, with_nuisances(white, nuisances, spread))
    assert found.std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(joint))[:3]))


def test_a_nuisance_without_spread_costs_nothing(rng, jacobian):
    white = np.eye(40)
    assert with_nuisances(white, rng.standard_normal((40, 1)), np.zeros(1)) == pytest.approx(white)


def test_a_prior_adds_its_information(jacobian):
    prior = np.array([0.01, 0.1, 1.0])
    found = cramer_rao(jacobian, np.eye(40), prior)
    information = jacobian.T @ jacobian + np.diag(1 / prior**2)
    assert found.std == pytest.approx(np.sqrt(np.diag(np.linalg.inv(information))))
    assert (found.std < cramer_rao(jacobian, np.eye(40)).std).all()
    assert (found.std < prior).all()


def test_a_direction_that_is_not_seen_is_not_known(jacobian):
    blind = jacobian.copy()
    blind[:, 2] = 2 * blind[:, 0]
    assert np.isinf(cramer_rao(blind, np.eye(40)).std).all()
    with_prior = cramer_rao(blind, np.eye(40), np.ones(3))
    assert np.isfinite(with_prior.std).all()
    assert with_prior.std[2] < 1


def test_fewer_numbers_than_unknowns_determine_nothing(jacobian):
    assert np.isinf(cramer_rao(jacobian[:2], np.eye(2)).worst_std)


def test_the_bound_follows_the_units_of_the_unknowns(jacobian):
    scale = np.array([1e-6, 1.0, 1e6])
    found, scaled = cramer_rao(jacobian, np.eye(40)), cramer_rao(jacobian * scale, np.eye(40))
    assert scaled.std * scale == pytest.approx(found.std)


def test_the_worst_direction_is_the_one_that_is_hardly_seen():
    jacobian = np.diag([10.0, 10.0, 0.1])
    found = cramer_rao(jacobian, np.eye(3))
    assert found.worst_direction == pytest.approx([0, 0, 1])
    assert found.worst_std == pytest.approx(10)


def test_frames_do_not_help_against_what_they_share(jacobian):
    """Ten times the frames: a third of white noise, next to nothing where a common error dominates."""
    shape = np.exp(-((np.arange(40)[:, None] - np.arange(40)) ** 2) / 50)

    def gain(common):
        few, many = (cramer_rao(jacobian, common * shape + np.eye(40) / n).std for n in (1, 10))
        return few / many

    assert gain(0.0) == pytest.approx(np.full(3, np.sqrt(10)))
    smooth = np.cos(np.outer(np.arange(40) / 20, np.arange(3)))
    few, many = (cramer_rao(smooth, 1e4 * shape + np.eye(40) / n).std for n in (1, 10))
    assert (few / many < 1.1).all()
