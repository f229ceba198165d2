"""The logistic network: its gradient against differences, and log odds that are known on paper."""

import numpy as np
import pytest

from host_tools.press_models.dense_network import DenseLayer, InputScaling, activations_of, initial_layers
from host_tools.press_models.train_ensemble import Adam
from host_tools.press_models.train_range import RangeNetwork, logistic_loss_and_gradient

INPUTS, ROWS = 6, 20


@pytest.fixture
def case() -> tuple[list[DenseLayer], np.ndarray, np.ndarray]:
    """Double precision throughout, as differences need it."""
    rng = np.random.default_rng(4)
    layers = [
        DenseLayer(*(np.asarray(part, np.float64) for part in one)) for one in initial_layers(INPUTS, rng, outputs=1)
    ]
    return layers, rng.normal(size=(ROWS, INPUTS)), rng.integers(0, 2, ROWS).astype(float)


def loss(layers: list[DenseLayer], inputs: np.ndarray, is_outside: np.ndarray) -> float:
    """The negative log likelihood, written out."""
    probability = 1 / (1 + np.exp(-activations_of(layers, inputs)[-1][:, 0]))
    return -float(np.mean(np.log(np.where(is_outside == 1, probability, 1 - probability))))


def test_the_loss_is_the_likelihood_of_what_is_so(case):
    assert logistic_loss_and_gradient(*case)[0] == pytest.approx(loss(*case))


@pytest.mark.parametrize("number", [0, 1, 2])
def test_the_gradient_equals_differences(case, number):
    layers, *seen = case
    gradient = logistic_loss_and_gradient(*case)[1][number]
    rng, step = np.random.default_rng(5), 1e-4
    direction = DenseLayer(*(rng.normal(size=part.shape) for part in layers[number]))
    along = sum(float(np.sum(g * d)) for g, d in zip(gradient, direction, strict=True))
    ends = []
    for sign in (step, -step):
        moved = DenseLayer(*(part + sign * way for part, way in zip(layers[number], direction, strict=True)))
        ends.append(loss([*layers[:number], moved, *layers[number + 1 :]], *seen))
    assert along == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-4, abs=1e-6)


def test_a_large_odd_costs_what_it_is_and_no_overflow(case):
    """-ln(1 / (1 + exp(x))) is x for large x."""
    layers, inputs, _ = case
    *hidden, last = layers
    sure = [*hidden, DenseLayer(0 * last.weights, last.biases + 1000)]
    assert logistic_loss_and_gradient(sure, inputs, np.zeros(ROWS))[0] == pytest.approx(1000)
    assert logistic_loss_and_gradient(sure, inputs, np.ones(ROWS))[0] == 0


def test_it_learns_the_log_odds_of_two_gaussians():
    """Means -1 and 1 in the first column, standard deviation 1: ln p1/p0 = 2 x, whatever the other columns."""
    rng = np.random.default_rng(6)
    is_outside = rng.integers(0, 2, 20_000)
    rows = rng.normal(size=(len(is_outside), 4))
    rows[:, 0] += 2 * is_outside - 1
    scaling = InputScaling.fit(rows, np.eye(4), directions=4)
    layers = initial_layers(8, rng, outputs=1)
    adam = Adam(layers, rate=3e-3, steps=600)
    inputs, target = scaling.inputs(rows.astype(np.float32)), is_outside.astype(np.float32)
    for _ in range(600):
        some = rng.integers(len(rows), size=512)
        adam.step(logistic_loss_and_gradient(layers, inputs[some], target[some])[1])
    at = np.zeros((9, 4))
    at[:, 0] = np.linspace(-2, 2, 9)
    np.testing.assert_allclose(RangeNetwork(scaling, (layers,)).log_odds(at), 2 * at[:, 0], atol=0.5)


def test_members_are_averaged():
    rng = np.random.default_rng(7)
    rows = rng.normal(size=(30, 5))
    scaling = InputScaling.fit(rows, np.eye(5), directions=5)
    members = tuple(initial_layers(10, rng, outputs=1) for _ in range(2))
    alone = [RangeNetwork(scaling, (member,)).log_odds(rows) for member in members]
    np.testing.assert_allclose(RangeNetwork(scaling, members).log_odds(rows), np.mean(alone, axis=0), rtol=1e-5)
    assert np.std(alone[0] - alone[1]) > 0
