"""The standard model's network: a profile row to mean and spread of the three unknowns' coordinates.

The row is projected on the directions in which presses differ most, measured in units of their noise, and every
direction enters twice: as it is, and by its area sine, since inclusions span three decades of contrast and a tenth of a
weak one matters as much as a tenth of a strong one. Two hidden layers of tanh; single precision.
Source: heteroscedastic networks, Nix & Weigend, Proc. ICNN 1994.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array, Single
from device.measurement.quantities import UNKNOWNS

DIRECTIONS, HIDDEN = 32, 96
LARGEST_LOG_VARIANCE = 1.0
"""An even prior has a log variance of -1.1: nothing is known less well."""


@dataclass(frozen=True, eq=False)
class InputScaling:
    """Row [P] to network inputs [2 K]: (row - mean) @ projection, plain and by its area sine, each over its spread."""

    mean: Single
    projection: Single
    plain_spread: Single
    area_sine_spread: Single

    @classmethod
    def fit(cls, rows: Array, noise: Array, directions: int = DIRECTIONS) -> InputScaling:
        """Return the scaling of rows [n, P] whose noise has a covariance [P, P]."""
        mean = rows.mean(axis=0)
        whitening = np.linalg.inv(np.linalg.cholesky(noise)).T
        *_, axes = np.linalg.svd((rows - mean) @ whitening, full_matrices=False)
        projection = whitening @ axes[:directions].T
        plain = (rows - mean) @ projection
        parts = mean, projection, plain.std(axis=0), np.arcsinh(plain).std(axis=0)
        return cls(*(np.asarray(part, np.float32) for part in parts))

    def inputs(self, rows: Single) -> Single:
        """Return the network's inputs [n, 2 K] of rows [n, P]."""
        plain = (rows - self.mean) @ self.projection
        return np.hstack([plain / self.plain_spread, np.arcsinh(plain) / self.area_sine_spread])


class DenseLayer(NamedTuple):
    """Weights [fan_in, fan_out] and biases [fan_out]."""

    weights: Single
    biases: Single


class Prediction(NamedTuple):
    """Mean [n, 3] of the unknowns' coordinates and logarithm of their variance [n, 3]."""

    mean: Single
    log_variance: Single


def initial_layers(
    inputs: int, rng: np.random.Generator, outputs: int = 2 * len(UNKNOWNS), hidden: int = HIDDEN
) -> list[DenseLayer]:
    """Return layers of random weights (Glorot & Bengio 2010) for so many inputs, outputs and hidden units a layer."""
    widths = (inputs, hidden, hidden, outputs)
    layers = []
    for fan_in, fan_out in pairwise(widths):
        spread = np.sqrt(2 / (fan_in + fan_out))
        weights = rng.normal(0, spread, (fan_in, fan_out)).astype(np.float32)
        layers.append(DenseLayer(weights, np.zeros(fan_out, np.float32)))
    return layers


def predict(layers: list[DenseLayer], inputs: Single) -> Prediction:
    """Return the prediction for inputs [n, 2 K]."""
    return _split(activations_of(layers, inputs)[-1])


def loss_and_gradient(layers: list[DenseLayer], inputs: Single, target: Single) -> tuple[float, list[DenseLayer]]:
    """Return the loss, mean over rows and unknowns, and its gradient; `target` [n, 3] in coordinates.

    Half the squared error, plus the Gaussian's negative log likelihood in which only the variance learns: mean and
    variance do not spoil each other where the noise is large.
    """
    activations = activations_of(layers, inputs)
    mean, log_variance = _split(activations[-1])
    error, inverse = mean - target, np.exp(-log_variance)
    square = error * error
    loss = 0.5 * float(np.mean(square + square * inverse + log_variance))
    by_output = np.hstack([error, 0.5 * (1 - square * inverse)]) / np.float32(error.size)
    inside = activations[-1][:, mean.shape[1] :] < LARGEST_LOG_VARIANCE
    by_output[:, mean.shape[1] :] *= inside
    return loss, backward(layers, activations, by_output.astype(np.float32))


def _split(output: Single) -> Prediction:
    half = output.shape[1] // 2
    return Prediction(output[:, :half], np.minimum(output[:, half:], np.float32(LARGEST_LOG_VARIANCE)))


def activations_of(layers: list[DenseLayer], inputs: Single) -> list[Single]:
    """Return the inputs [n, 2 K], what each hidden layer makes of them, and the outputs, which are linear."""
    values = [inputs]
    for number, (weights, biases) in enumerate(layers):
        signal = values[-1] @ weights + biases
        values.append(signal if number == len(layers) - 1 else np.tanh(signal))
    return values


def backward(layers: list[DenseLayer], activations: list[Single], by_output: Single) -> list[DenseLayer]:
    """Return the gradient by weights and biases, of a loss whose derivatives by the outputs are `by_output`."""
    gradient, delta = [], by_output
    for (weights, _), before in zip(reversed(layers), reversed(activations[:-1]), strict=True):
        gradient.append(DenseLayer(before.T @ delta, delta.sum(axis=0)))
        delta = (delta @ weights.T) * (1 - before * before)
    return gradient[::-1]
