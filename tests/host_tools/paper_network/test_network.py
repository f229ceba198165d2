"""The network against hand calculation, and its gradient against differences."""

from __future__ import annotations

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from host_tools.paper_network.network import (
    MEAN_SQUARE,
    MISFIT,
    PARAMETER_COUNT,
    Ensemble,
    Loss,
    Scaling,
    forward,
    initial_parameters,
    loss_and_gradient,
    mean_square,
    misfit,
    sigmoid,
    unpack,
)


def identity_scaling() -> Scaling:
    return Scaling(np.full(3, 1e-9), np.zeros(3), np.ones(3), np.array([0.0, 4.0, 40.0]), np.array([15.0, 12.0, 120.0]))


def test_three_ten_four_three_has_ninety_nine_parameters() -> None:
    assert PARAMETER_COUNT == 99


def test_parameters_are_laid_out_weights_then_biases_layer_by_layer() -> None:
    """With parameters 0..98: 30 weights, 10 biases, 40 weights, 4 biases, 12 weights, 3 biases."""
    first, second, third = unpack(np.arange(99.0))
    assert first.weights.shape == (3, 10)
    assert first.weights[1, 0] == 10
    assert first.biases[0, 0] == 30
    assert second.weights[0, 0] == 40
    assert second.biases[0, -1] == 83
    assert third.weights[-1, -1] == 95
    assert third.biases.tolist() == [[96.0, 97.0, 98.0]]


def test_the_sigmoid_is_logistic_and_never_overflows() -> None:
    """1/(1+exp(-ln 3)) = 3/4."""
    assert sigmoid(np.array([-1000.0, 0.0, np.log(3.0), 1000.0])) == pytest.approx([0.0, 0.5, 0.75, 1.0])


def test_forward_agrees_with_hand_calculation() -> None:
    """No hidden weights: every sigmoid is at 0.5, so output weights of 1 give 4*0.5 and biases (1, 2, 3) add to it."""
    parameters = np.zeros(99)
    unpack(parameters)[2].weights[...] = 1.0
    unpack(parameters)[2].biases[...] = [1.0, 2.0, 3.0]
    assert forward(parameters, np.ones((2, 3))) == pytest.approx(np.array([[3.0, 4.0, 5.0]] * 2))


def test_stacked_networks_answer_as_each_alone() -> None:
    stack = np.array([initial_parameters(np.random.default_rng(seed)) for seed in range(3)])
    inputs = np.random.default_rng(9).normal(size=(5, 3))
    together = forward(stack, inputs)
    assert together.shape == (3, 5, 3)
    assert together[2] == pytest.approx(forward(stack[2], inputs), rel=1e-12)


def test_misfit_is_half_the_log_of_the_mean_squares() -> None:
    """Squares of constant size (0.99, 3.99, 8.99) and the least variance 0.01 make 1, 4, 9: ln(1 * 4 * 9)/2 = ln 6."""
    residual = np.tile([1.0, -1.0], (3, 2)).T * np.sqrt([0.99, 3.99, 8.99])
    assert misfit(residual) == pytest.approx(np.log(6.0))


def test_mean_square_is_half_the_sum_of_the_mean_squares() -> None:
    """Squares of constant size 1, 4, 9: (1 + 4 + 9)/2 = 7."""
    assert mean_square(np.tile([1.0, -1.0], (3, 2)).T * [1.0, 2.0, 3.0]) == pytest.approx(7.0)


@pytest.mark.parametrize("loss", [MISFIT, MEAN_SQUARE])
def test_the_gradient_agrees_with_differences(loss: Loss) -> None:
    """Central differences of step 1e-6 are wrong by some 1e-10 of the third derivative and by rounding 1e-10."""
    rng = np.random.default_rng(3)
    parameters, inputs, targets = rng.normal(size=99), rng.normal(size=(20, 3)), rng.normal(size=(20, 3))
    _, gradient = loss_and_gradient(parameters, inputs, targets, loss)
    steps = 1e-6 * np.eye(99)
    differences = [
        (
            loss_and_gradient(parameters + step, inputs, targets, loss)[0]
            - loss_and_gradient(parameters - step, inputs, targets, loss)[0]
        )
        / 2e-6
        for step in steps
    ]
    assert gradient == pytest.approx(np.array(differences), abs=1e-8)


def test_initial_weights_follow_nguyen_and_widrow() -> None:
    """Each hidden unit's weights have length 2 * 0.7 * 10^(1/3), its bias lies within, and the seed fixes them all."""
    parameters = initial_parameters(np.random.default_rng(5))
    first = unpack(parameters)[0]
    assert np.linalg.norm(first.weights, axis=0) == pytest.approx(1.4 * 10 ** (1 / 3))
    assert np.all(np.abs(first.biases) <= 1.4 * 10 ** (1 / 3))
    assert np.array_equal(parameters, initial_parameters(np.random.default_rng(5)))


def test_inputs_are_z_scored_logarithms_of_peak_ratio_and_area() -> None:
    """Rows (1, 1, 1) and (e2, e6, e2): (ln O1, ln O2/O1, ln O3) = (0, 0, 0) and (2, 4, 2), so -1 and +1."""
    features = np.array([[1.0, 1.0, 1.0], [np.exp(2), np.exp(6), np.exp(2)]])
    scaling = Scaling.fit(features)
    assert scaling.log_mean == pytest.approx([1.0, 2.0, 1.0])
    assert scaling.log_std == pytest.approx([1.0, 2.0, 1.0])
    assert scaling.inputs(features) == pytest.approx(np.array([[-1.0] * 3, [1.0] * 3]))


def test_features_below_the_floor_count_as_the_floor() -> None:
    scaling = Scaling.fit(np.array([[1.0, 1.0, 1.0], [2.0, 3.0, 4.0]]))
    assert np.array_equal(scaling.inputs(np.array([[0.0, -1.0, 0.0]])), scaling.inputs(scaling.floor[None]))


def test_the_box_maps_to_minus_one_and_one() -> None:
    scaling = identity_scaling()
    corners = np.array([[0.0, 4.0, 40.0], [7.5, 8.0, 80.0], [15.0, 12.0, 120.0]])
    assert scaling.targets(corners) == pytest.approx(np.array([[-1.0] * 3, [0.0] * 3, [1.0] * 3]))
    assert scaling.unknowns(scaling.targets(corners)) == pytest.approx(corners)


def test_features_that_never_change_are_refused() -> None:
    with pytest.raises(InvalidQuantity, match="spread of network input 3 is 0"):
        Scaling.fit(np.array([[1.0, 1.0, 5.0], [2.0, 3.0, 5.0]]))


def test_an_ensemble_gives_mean_and_standard_deviation_over_its_trials() -> None:
    """Two networks answer -1 and +1 whatever the input: mean = centre of the box; the sample standard deviation of
    -1 and 1 is sqrt(2), times half the box (7.5, 4, 40)."""
    parameters = np.zeros((2, 99))
    parameters[:, -3:] = [[-1.0], [1.0]]
    estimate, spread = Ensemble(identity_scaling(), parameters).estimate(np.ones((1, 3)))
    assert estimate == pytest.approx(np.array([[7.5, 8.0, 80.0]]))
    assert spread == pytest.approx(np.sqrt(2) * np.array([[7.5, 4.0, 40.0]]))


def test_one_network_is_no_ensemble() -> None:
    with pytest.raises(InvalidQuantity, match="trials is 1, but must be at least 2"):
        Ensemble(identity_scaling(), np.zeros((1, 99)))
