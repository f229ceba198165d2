"""The network's gradient against differences of what it descends, and its inputs on noise that is known."""

from typing import NamedTuple

import numpy as np
import pytest

from host_tools.press_models.dense_network import (
    HIDDEN,
    LARGEST_LOG_VARIANCE,
    DenseLayer,
    InputScaling,
    initial_layers,
    loss_and_gradient,
    predict,
)

INPUTS, ROWS = 6, 20


class Case(NamedTuple):
    layers: list[DenseLayer]
    inputs: np.ndarray
    target: np.ndarray


@pytest.fixture
def case() -> Case:
    """Double precision throughout, as differences need it."""
    rng = np.random.default_rng(4)
    layers = [DenseLayer(*(np.asarray(part, np.float64) for part in layer)) for layer in initial_layers(INPUTS, rng)]
    return Case(layers, rng.normal(size=(ROWS, INPUTS)), rng.uniform(-1, 1, (ROWS, 3)))


def changed(layers: list[DenseLayer], number: int, direction: DenseLayer, step: float) -> list[DenseLayer]:
    moved = DenseLayer(*(part + step * way for part, way in zip(layers[number], direction, strict=True)))
    return [*layers[:number], moved, *layers[number + 1 :]]


def descended(layers: list[DenseLayer], case: Case, held: np.ndarray) -> float:
    """What the gradient is of: squared error plus likelihood, whose squares are `held` where they are."""
    mean, log_variance = predict(layers, case.inputs)
    return 0.5 * float(np.mean((mean - case.target) ** 2 + held * np.exp(-log_variance) + log_variance))


@pytest.mark.parametrize("number", [0, 1, 2])
def test_the_gradient_equals_differences_when_only_the_variance_learns_from_the_likelihood(case, number):
    held = (predict(case.layers, case.inputs).mean - case.target) ** 2
    gradient = loss_and_gradient(*case)[1][number]
    rng, step = np.random.default_rng(5), 1e-4
    for _ in range(5):
        direction = DenseLayer(*(rng.normal(size=part.shape) for part in case.layers[number]))
        along = sum(float(np.sum(g * d)) for g, d in zip(gradient, direction, strict=True))
        ahead, behind = (descended(changed(case.layers, number, direction, s), case, held) for s in (step, -step))
        assert along == pytest.approx((ahead - behind) / (2 * step), rel=1e-4, abs=1e-6)


def test_the_loss_is_the_squared_error_plus_the_gaussians_likelihood(case):
    mean, log_variance = predict(case.layers, case.inputs)
    square = (mean - case.target) ** 2
    expected = 0.5 * np.mean(square) + 0.5 * np.mean(square / np.exp(log_variance) + log_variance)
    assert loss_and_gradient(*case)[0] == pytest.approx(expected, rel=1e-12)


def test_the_mean_does_not_learn_from_the_likelihood(case):
    """A variance a hundred times smaller changes how wrong a mean seems, but not where it goes."""
    sure = DenseLayer(case.layers[2].weights, case.layers[2].biases - np.repeat([0.0, np.log(100)], 3))
    before, after = (
        loss_and_gradient(c.layers, *c[1:])[1][2] for c in (case, case._replace(layers=[*case.layers[:2], sure]))
    )
    np.testing.assert_array_equal(before.weights[:, :3], after.weights[:, :3])
    assert np.abs(before.weights[:, 3:] - after.weights[:, 3:]).max() > 0.01


def test_the_log_variance_is_capped_and_does_not_learn_there(case):
    unsure = DenseLayer(case.layers[2].weights, case.layers[2].biases + np.repeat([0.0, 50.0], 3))
    layers = [*case.layers[:2], unsure]
    np.testing.assert_array_equal(predict(layers, case.inputs).log_variance, LARGEST_LOG_VARIANCE)
    last = loss_and_gradient(layers, case.inputs, case.target)[1][2]
    np.testing.assert_array_equal(last.weights[:, 3:], 0.0)
    np.testing.assert_array_equal(last.biases[3:], 0.0)
    assert np.abs(last.biases[:3]).max() > 0


def test_networks_are_two_hidden_layers_with_a_mean_and_a_variance_for_each_unknown():
    layers = initial_layers(INPUTS, np.random.default_rng(1))
    assert [layer.weights.shape for layer in layers] == [(INPUTS, HIDDEN), (HIDDEN, HIDDEN), (HIDDEN, 6)]
    assert {part.dtype for layer in layers for part in layer} == {np.dtype(np.float32)}
    assert layers[1].weights.std() == pytest.approx(np.sqrt(1 / HIDDEN), rel=0.05)
    assert [part.shape for part in predict(layers, np.zeros((5, INPUTS), np.float32))] == [(5, 3), (5, 3)]


def test_in_the_inputs_noise_of_a_known_covariance_is_white():
    rng = np.random.default_rng(6)
    factor = rng.normal(size=(5, 5))
    signal = 30 * rng.normal(size=(2000, 5)) @ rng.normal(size=(5, 5))
    scaling = InputScaling.fit(signal, factor @ factor.T, directions=4)
    projected = rng.normal(size=(40_000, 5)) @ factor.T @ scaling.projection
    np.testing.assert_allclose(np.cov(projected.T), np.eye(4), atol=0.03)


def test_the_directions_are_those_in_which_rows_differ_most_against_their_noise():
    """Both columns spread alike, the second is ten times as noisy: the first says more."""
    rows = np.random.default_rng(7).normal(size=(5000, 2))
    projection = InputScaling.fit(rows, np.diag([0.01, 1.0]), directions=1).projection[:, 0]
    assert np.abs(projection) == pytest.approx([10.0, 0.0], abs=0.05)


def test_inputs_are_plain_and_area_sine_of_spread_one():
    rows = np.random.default_rng(8).normal(3.0, 50.0, (500, 3))
    scaling = InputScaling.fit(rows, np.eye(3), directions=2)
    inputs = scaling.inputs(rows.astype(np.float32))
    np.testing.assert_allclose(inputs.std(axis=0), 1.0, rtol=1e-4)
    plain, area_sine = inputs[:, :2] * scaling.plain_spread, inputs[:, 2:] * scaling.area_sine_spread
    np.testing.assert_allclose(np.sinh(area_sine), plain, rtol=1e-4, atol=1e-3)
