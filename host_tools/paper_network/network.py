"""Turns three features of one press into (size_mm, depth_mm, youngs_modulus_kpa): the paper's 3-10-4-3 network.

The hidden layers are logistic sigmoids (0..1, not tanh), the output is linear. The features enter as logarithms above
a floor, and the answer is the mean of many networks that differ only in their seed.
Source: Lee & Won, IEEE JBHI 17(2), 2013, sections II (layers, box) and IV-A (100 trials, averaged).

Levenberg-Marquardt needs residuals of the training rows and their Jacobian [3 n, 99]. For the mean square the residuals
are the outputs' own. For the misfit they are divided by each unknown's scatter where the step begins: J'r is then the
misfit's gradient, and since the logarithm lies below its tangents, a step that lowers these squares lowers the misfit
too (iteratively reweighted least squares).
Source: Hagan & Menhaj, IEEE Trans. Neural Networks 5(6):989-993, 1994 (one back-propagation an output).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW

LAYERS = (3, 10, 4, 3)
"""Widths: three features, two hidden layers, three unknowns."""

PARAMETER_COUNT = sum((fan_in + 1) * fan_out for fan_in, fan_out in pairwise(LAYERS))
"""99 weights and biases: 3*10+10 + 10*4+4 + 4*3+3."""

LOG_RATIOS = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
"""(ln O1, ln O2, ln O3) @ LOG_RATIOS = (ln O1, ln O2/O1, ln O3): how high, how wide at the foot, how wide at the top.

O1 and O2 alone rise together over four decades, and the little that depth adds would hide in their difference."""

FEATURE_FLOOR = (1e-4, 1e-3, 0.1)
"""Below these (mm, mm3, mm2) the probe resolves nothing, and a logarithm would magnify that nothing.

1e-4 mm is a hundredth of the median inclusion field of the paper's box; 1e-3 mm3 is that height under a half-maximum
spot of radius 2 mm; 0.1 mm2 is some ninety pixels and only guards the logarithm. Floors of 1e-5/1e-4 and of 3e-4/6e-3
change the held-out errors of size and depth by less than 0.1 percentage point.
"""

LOGISTIC_GAIN = 2.0
"""Nguyen & Widrow place the steps of tanh(z); logistic(z) = (1 + tanh(z/2))/2 needs twice the weights."""


def sigmoid(z: Array) -> Array:
    """Return 1/(1+exp(-z)), written with tanh so that no exponential overflows."""
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * z)))


class Layer(NamedTuple):
    """Views into flat parameters: weights [..., fan_in, fan_out] and biases [..., 1, fan_out]."""

    weights: Array
    biases: Array


def unpack(parameters: Array) -> list[Layer]:
    """Return the three layers of flat parameters [..., 99]; writing into them writes into `parameters`."""
    layers, start = [], 0
    for fan_in, fan_out in pairwise(LAYERS):
        middle, end = start + fan_in * fan_out, start + (fan_in + 1) * fan_out
        weights = parameters[..., start:middle].reshape(*parameters.shape[:-1], fan_in, fan_out)
        layers.append(Layer(weights, parameters[..., None, middle:end]))
        start = end
    return layers


def forward(parameters: Array, inputs: Array) -> Array:
    """Return the scaled outputs [..., n, 3] of parameters [..., 99] for scaled inputs [n, 3]."""
    *hidden, last = unpack(parameters)
    signal = inputs
    for layer in hidden:
        signal = sigmoid(signal @ layer.weights + layer.biases)
    return np.asarray(signal @ last.weights + last.biases)


LEAST_VARIANCE = 0.01
"""Square of a tenth of half the box. Without it the logarithm rewards polishing without end the unknown that is known
best, and the others are given up even where the features determine them: Young's modulus was 37 % off instead of 0.3 %
on features that can be inverted on paper."""


def misfit(residual: Array) -> float:
    """Return half the sum over the unknowns of ln(mean squared scaled residual [n, 3] + `LEAST_VARIANCE`).

    This is the Gaussian misfit, m/(2v) + ln(v)/2 for each unknown's mean square m, at its best noise variance v = m:
    each unknown is judged by its own scatter. A plain mean square is nearly all Young's modulus, whose residual the
    physics leaves large: its overfitting then stops the training before size and depth are learned. Measured on finite
    elements, mean relative error of d, h, E above 3 mm: 4.7, 2.7, 27.8 % with the plain mean square, 1.6, 1.1, 27.6 %
    with this.
    """
    return 0.5 * float(np.sum(np.log(np.mean(residual**2, axis=0) + LEAST_VARIANCE)))


def mean_square(residual: Array) -> float:
    """Return half the sum over the unknowns of the mean squared scaled residual [n, 3]: the loss of the textbooks."""
    return 0.5 * float(np.sum(np.mean(residual**2, axis=0)))


class Loss(NamedTuple):
    """What training minimises; its derivative by a residual of n rows is residual / (n variance)."""

    value: Callable[[Array], float]
    variance: Callable[[Array], Array]


MISFIT = Loss(misfit, lambda residual: np.asarray(np.mean(residual**2, axis=0) + LEAST_VARIANCE))
MEAN_SQUARE = Loss(mean_square, lambda residual: np.ones(residual.shape[1]))


def loss_and_gradient(parameters: Array, inputs: Array, targets: Array, loss: Loss = MISFIT) -> tuple[float, Array]:
    """Return the loss of scaled rows (inputs and targets [n, 3]) and its gradient [99] by back-propagation.

    Source of back-propagation: Rumelhart, Hinton & Williams, Nature 323:533-536, 1986.
    """
    layers, signals = unpack(parameters), [inputs]
    for layer in layers[:-1]:
        signals.append(sigmoid(signals[-1] @ layer.weights + layer.biases))
    residual = signals[-1] @ layers[-1].weights + layers[-1].biases - targets
    gradient = np.empty_like(parameters)
    slope = residual / (len(inputs) * loss.variance(residual))  # [n, 3]
    for layer, gradients, signal in zip(layers[::-1], unpack(gradient)[::-1], signals[::-1], strict=True):
        gradients.weights[...] = signal.T @ slope
        gradients.biases[...] = slope.sum(axis=0)
        slope = (slope @ layer.weights.T) * signal * (1.0 - signal)  # [n, fan_in]
    return loss.value(residual), gradient


def initial_parameters(rng: np.random.Generator) -> Array:
    """Return starting parameters [99] for z-scored inputs: steps of random direction, spread over the inputs' range.

    Source: D. Nguyen & B. Widrow, IJCNN 1990, vol. 3, pp. 21-26.
    """
    parameters = np.empty(PARAMETER_COUNT)
    for weights, biases in unpack(parameters):
        fan_in, fan_out = weights.shape
        length = LOGISTIC_GAIN * 0.7 * fan_out ** (1.0 / fan_in)
        weights[...] = rng.uniform(-1.0, 1.0, weights.shape)
        weights *= length / np.linalg.norm(weights, axis=0)
        biases[...] = rng.uniform(-length, length, biases.shape)
    return parameters


@dataclass(frozen=True, eq=False)
class Scaling:
    """Features to network inputs (z-scored logarithms) and network outputs to unknowns (-1..1 over the box)."""

    floor: Array
    log_mean: Array
    log_std: Array
    box_low: Array
    box_high: Array

    @classmethod
    def fit(cls, features: Array) -> Scaling:
        """Return the scaling of training features [n, 3]; raises `InvalidQuantity` when a column never changes."""
        floor = np.array(FEATURE_FLOOR)
        logs = np.log(np.maximum(features, floor)) @ LOG_RATIOS
        mean, std = logs.mean(axis=0), logs.std(axis=0)
        for column, spread in enumerate(std):
            if spread < 1e-9:
                name = f"spread of network input {column + 1}"
                raise InvalidQuantity(name, spread, "above 0", "give scenes that differ, above the feature floor")
        return cls(floor, mean, std, np.array(PAPER_BOX_LOW), np.array(PAPER_BOX_HIGH))

    def inputs(self, features: Array) -> Array:
        """Return network inputs [n, 3] of features [n, 3]; what is below the floor counts as the floor."""
        logs = np.log(np.maximum(features, self.floor)) @ LOG_RATIOS
        return np.asarray((logs - self.log_mean) / self.log_std)

    def targets(self, unknowns: Array) -> Array:
        """Return network targets [n, 3] of unknowns [n, 3]."""
        return np.asarray(2.0 * (unknowns - self.box_low) / (self.box_high - self.box_low) - 1.0)

    def unknowns(self, outputs: Array) -> Array:
        """Return the unknowns [..., 3] of network outputs [..., 3]."""
        return np.asarray(self.box_low + 0.5 * (outputs + 1.0) * (self.box_high - self.box_low))


class EnsembleEstimate(NamedTuple):
    """Mean [n, 3] and sample standard deviation [n, 3] over the trials, in mm, mm, kPa."""

    estimate: Array
    spread: Array


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Networks with one scaling; parameters [trials, 99], at least two trials.

    The spread tells how much the answer depends on the seed. It is no accuracy: all trials share the same data.
    """

    scaling: Scaling
    parameters: Array

    def __post_init__(self) -> None:
        require("trials", len(self.parameters), Bound(2, 10_000, "networks"), "train at least two, for a spread")

    def estimate(self, features: Array) -> EnsembleEstimate:
        """Return the estimate of features [n, 3] in mm, mm3, mm2; extrapolates silently outside the training range."""
        trials = self.scaling.unknowns(forward(self.parameters, self.scaling.inputs(features)))  # [trials, n, 3]
        return EnsembleEstimate(trials.mean(axis=0), trials.std(axis=0, ddof=1))


def outputs_and_jacobian(parameters: Array, inputs: Array) -> tuple[Array, Array]:
    """Return the scaled outputs [n, 3] of scaled inputs [n, 3] and their derivatives [n, 3, 99] by the parameters."""
    layers, signals = unpack(parameters), [inputs]
    for layer in layers[:-1]:
        signals.append(sigmoid(signals[-1] @ layer.weights + layer.biases))
    outputs = signals[-1] @ layers[-1].weights + layers[-1].biases
    jacobian = np.empty((*outputs.shape, len(parameters)))
    slope = np.broadcast_to(np.eye(LAYERS[-1]), (*outputs.shape, LAYERS[-1]))  # [n, 3, fan_out]
    for layer, derivatives, signal in zip(layers[::-1], unpack(jacobian)[::-1], signals[::-1], strict=True):
        derivatives.weights[...] = signal[:, None, :, None] * slope[:, :, None, :]
        derivatives.biases[...] = slope[:, :, None, :]
        slope = (slope @ layer.weights.T) * (signal * (1.0 - signal))[:, None, :]
    return outputs, jacobian


@dataclass(frozen=True, eq=False)
class NetworkResiduals:
    """The least-squares problem of fitting the network to scaled rows, inputs and targets [n, 3]."""

    inputs: Array
    targets: Array
    loss: Loss = MISFIT

    def value(self, parameters: Array) -> float:
        """Return the loss."""
        return self.loss.value(forward(parameters, self.inputs) - self.targets)

    def linearise(self, parameters: Array) -> tuple[Array, Array]:
        """Return residuals [3 n] and Jacobian [3 n, 99]."""
        outputs, jacobian = outputs_and_jacobian(parameters, self.inputs)
        residual = outputs - self.targets
        weight = 1.0 / np.sqrt(len(self.inputs) * self.loss.variance(residual))  # [3]
        return (weight * residual).ravel(), (weight[:, None] * jacobian).reshape(-1, len(parameters))
