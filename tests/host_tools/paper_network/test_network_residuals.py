"""The Jacobian by back-propagation, and what Levenberg-Marquardt minimises with it."""

from __future__ import annotations

import numpy as np
import pytest

from device.measurement.arrays import Array
from host_tools.paper_network.network import (
    LEAST_VARIANCE,
    MEAN_SQUARE,
    MISFIT,
    Loss,
    NetworkResiduals,
    forward,
    loss_and_gradient,
    misfit,
    outputs_and_jacobian,
)


@pytest.fixture
def drawn() -> tuple[Array, Array, Array]:
    """Parameters [99], inputs [20, 3] and targets [20, 3]."""
    rng = np.random.default_rng(3)
    return rng.normal(size=99), rng.normal(size=(20, 3)), rng.normal(size=(20, 3))


def test_the_jacobian_agrees_with_differences(drawn: tuple[Array, Array, Array]) -> None:
    """Central differences of step 1e-6 are wrong by some 1e-10."""
    parameters, inputs, _ = drawn
    outputs, jacobian = outputs_and_jacobian(parameters, inputs)
    steps = 1e-6 * np.eye(99)
    differences = [(forward(parameters + step, inputs) - forward(parameters - step, inputs)) / 2e-6 for step in steps]
    assert np.array_equal(outputs, forward(parameters, inputs))
    assert jacobian == pytest.approx(np.moveaxis(differences, 0, -1), abs=1e-8)


@pytest.mark.parametrize("loss", [MISFIT, MEAN_SQUARE])
def test_jacobian_and_residuals_give_the_gradient_of_the_loss(loss: Loss, drawn: tuple[Array, Array, Array]) -> None:
    parameters, inputs, targets = drawn
    problem = NetworkResiduals(inputs, targets, loss)
    residuals, jacobian = problem.linearise(parameters)
    value, gradient = loss_and_gradient(parameters, inputs, targets, loss)
    assert problem.value(parameters) == pytest.approx(value, rel=1e-14)
    assert jacobian.T @ residuals == pytest.approx(gradient, abs=1e-14)


def test_the_mean_square_is_half_the_square_of_its_residuals(drawn: tuple[Array, Array, Array]) -> None:
    parameters, inputs, targets = drawn
    problem = NetworkResiduals(inputs, targets, MEAN_SQUARE)
    residuals, _ = problem.linearise(parameters)
    assert 0.5 * residuals @ residuals == pytest.approx(problem.value(parameters), rel=1e-14)


def test_what_lowers_the_squares_over_the_old_scatter_lowers_the_misfit() -> None:
    """The logarithm lies below its tangents: ln(b/a) <= b/a - 1. A third of the drawn changes do."""
    rng = np.random.default_rng(1)
    lowered = 0
    for _ in range(200):
        before = rng.normal(size=(20, 3)) * rng.lognormal(size=3)
        after = before + rng.normal(size=(20, 3)) * rng.normal(0.0, 0.3, size=3) - 0.1 * before
        scatter = np.mean(before**2, axis=0) + LEAST_VARIANCE
        if np.sum(np.mean(after**2, axis=0) / scatter) <= np.sum(np.mean(before**2, axis=0) / scatter):
            lowered += 1
            assert misfit(after) <= misfit(before)
    assert lowered > 20
