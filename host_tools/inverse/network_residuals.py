"""Network parameters to residuals of the training rows and their Jacobian [3 n, 99]: what Levenberg-Marquardt needs.

For the mean square the residuals are the outputs' own. For the misfit they are divided by each unknown's scatter where
the step begins: J'r is then the misfit's gradient, and since the logarithm lies below its tangents, a step that lowers
these squares lowers the misfit too (iteratively reweighted least squares).
Source: Hagan & Menhaj, IEEE Trans. Neural Networks 5(6):989-993, 1994 (one back-propagation an output).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from host_tools.inverse.network import LAYERS, MISFIT, Array, Loss, forward, sigmoid, unpack


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
