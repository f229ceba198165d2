"""The network that tells lumps outside the trained ranges from those within: a profile row to log odds.

As `dense_network`, with one output and the logistic loss, which makes it the logarithm of the odds that size or depth
lies outside, when lumps are drawn as the training presses are. By Neyman and Pearson no number of a row tells more of
the ones, at as many false flags of the others, than the exact odds, which these networks approach.
Source: Bishop, Pattern Recognition and Machine Learning, 2006, section 4.3.4, on the loss.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from host_tools.inverse.dense_network import Array, InputScaling, Layer, Single, activations_of, backward


@dataclass(frozen=True, eq=False)
class RangeNetwork:
    """Networks that share one scaling of the inputs; their log odds are averaged."""

    scaling: InputScaling
    members: tuple[list[Layer], ...]

    def log_odds(self, rows: Array) -> Array:
        """Return the log odds [n] that size or depth lies outside, for rows [n, P]."""
        inputs = self.scaling.inputs(rows.astype(np.float32))
        return np.asarray(np.mean([activations_of(layers, inputs)[-1][:, 0] for layers in self.members], axis=0))


def logistic_loss_and_gradient(layers: list[Layer], inputs: Single, is_outside: Single) -> tuple[float, list[Layer]]:
    """Return the mean of -ln(probability of what is so), and its gradient; `is_outside` [n] is 0 or 1."""
    activations = activations_of(layers, inputs)
    log_odds = activations[-1][:, 0]
    loss = float(np.mean(np.logaddexp(0, log_odds) - is_outside * log_odds))
    by_output = ((expit(log_odds) - is_outside) / np.float32(len(log_odds)))[:, None]
    return loss, backward(layers, activations, by_output.astype(np.float32))
