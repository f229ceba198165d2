"""Adam on losses whose minimum is known."""

import numpy as np
import pytest

from host_tools.press_models.dense_network import DenseLayer
from host_tools.press_models.train_ensemble import Adam


def layers_of(weights: object, biases: object = (0.0,)) -> list[DenseLayer]:
    return [DenseLayer(np.array(weights, np.float32), np.array(biases, np.float32))]


def test_a_quadratic_is_minimised_whatever_the_scales_of_its_directions():
    minimum, curvature = np.array([[1.0, -2.0]], np.float32), np.array([[1e3, 1e-2]], np.float32)
    layers = layers_of([[0.0, 0.0]], [3.0])
    adam = Adam(layers, rate=0.05, steps=1500)
    for _ in range(1500):
        adam.step([DenseLayer(curvature * (layers[0].weights - minimum), layers[0].biases.copy())])
    np.testing.assert_allclose(layers[0].weights, minimum, atol=1e-4)
    np.testing.assert_allclose(layers[0].biases, 0.0, atol=1e-4)


def test_the_first_step_is_the_rate_whatever_the_gradient():
    """Kingma & Ba, section 2.1: with the bias taken out, the first step is rate x sign(gradient)."""
    layers = layers_of([[0.0, 0.0, 0.0]])
    Adam(layers, rate=0.1, steps=10**6).step(layers_of([[1e-3, -5.0, 0.0]]))
    np.testing.assert_allclose(layers[0].weights, [[-0.1, 0.1, 0.0]], rtol=1e-3)


def test_under_a_constant_gradient_the_way_is_half_the_rate_times_the_steps():
    """A cosine's mean is a half; a constant gradient makes every step as long as the rate."""
    layers = layers_of([[0.0]])
    adam = Adam(layers, rate=0.01, steps=400)
    for _ in range(400):
        adam.step(layers_of([[2.0]]))
    assert layers[0].weights.item() == pytest.approx(-0.01 * 400 / 2, rel=0.01)


def test_the_rate_is_nothing_at_the_end_and_beyond():
    layers = layers_of([[0.0]])
    adam = Adam(layers, rate=0.1, steps=5)
    for _ in range(4):
        adam.step(layers_of([[1.0]]))
    before = layers[0].weights.copy()
    assert before.item() < 0
    for _ in range(3):
        adam.step(layers_of([[1.0]]))
    np.testing.assert_array_equal(layers[0].weights, before)
