"""Adam: stochastic gradient descent with a step of its own for every weight, under a cosine schedule.

For networks of ten thousand weights on endless random presses; the paper's 99 weights learn by SCG.
Sources: Kingma & Ba, ICLR 2015, algorithm 1; Loshchilov & Hutter, ICLR 2017, on the schedule.
"""

from __future__ import annotations

import numpy as np

from host_tools.inverse.dense_network import Layer, Single

DECAY_MEAN, DECAY_SQUARE, TINY = 0.9, 0.999, np.float32(1e-8)


class Adam:
    """Holds the moments of the gradient of each layer, and changes the layers in place."""

    def __init__(self, layers: list[Layer], *, rate: float, steps: int) -> None:
        """The rate falls from `rate` to nothing over `steps`."""
        self._parts = [part for layer in layers for part in layer]
        self._mean = [np.zeros_like(part) for part in self._parts]
        self._square = [np.zeros_like(part) for part in self._parts]
        self._rate, self._steps, self._done = rate, steps, 0

    def step(self, gradient: list[Layer]) -> None:
        """Move all weights against a gradient."""
        self._done += 1
        rate = 0.5 * self._rate * (1 + np.cos(np.pi * min(self._done / self._steps, 1.0)))
        rate *= np.sqrt(1 - DECAY_SQUARE**self._done) / (1 - DECAY_MEAN**self._done)
        slopes: list[Single] = [part for layer in gradient for part in layer]
        for part, slope, mean, square in zip(self._parts, slopes, self._mean, self._square, strict=True):
            mean += np.float32(1 - DECAY_MEAN) * (slope - mean)
            square += np.float32(1 - DECAY_SQUARE) * (slope * slope - square)
            part -= np.float32(rate) * mean / (np.sqrt(square) + TINY)
