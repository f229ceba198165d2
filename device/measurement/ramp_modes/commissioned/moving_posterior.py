"""The posterior of presses of a commissioned probe near its best fit, where what the probe changes follows the place.

`OwnPosterior` holds shift and directions as they are about a point. A press in uneven tissue takes several deviations
of these, and what they do changes with size and depth: the fit then ends where its own start has put it. Here the
likeliest changes follow the coordinates to first order. So a fit is a Gauss-Newton step of coordinates and directions
together, and repeated ones come to a best fit of both.
Lines leave what they touch: far from there this says nothing, and answers are not sampled from it.
Source: Kaufman, BIT 15 (1975), variable projection of separable least squares; docs/own_probe.md.
"""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array
from device.measurement.ramp_modes.commissioned.own_posterior import AXES, OwnPosterior
from device.measurement.ramp_modes.surrogate import OFFSET

STEP = 0.01
"""Of a coordinate, by which its derivative is taken; ranges run from -1 to 1."""


class MovingPosterior(OwnPosterior):
    """What explains presses about coordinates [8 + 2 N], as `before` does, but that its likeliest changes follow them.

    `before` was linear about another point; which changes are likeliest is told by its best fit `at`.
    """

    def __init__(self, before: OwnPosterior, at: Array) -> None:
        """Take the posterior before, and its best fit [8 + 2 N]."""
        super().__init__(before.seen, before.surrogate, before.noise, before.own, before.reach_mm, at)
        self._at = np.array(at)
        self._slope = self.whitened(self._by_coordinates(before.likeliest_changes(at)))

    def _by_coordinates(self, likeliest: Array) -> Array:
        """Return the derivatives [S, 8 + 2 N] of changes of which the K shared ones are [K] deviations."""
        here, number = self.moved(self._at, likeliest), np.arange(self.dimensions)
        step = np.where(self._at > 0, -STEP, STEP)  # towards the middle of the range
        slope = np.zeros((len(here), self.dimensions))
        for k in range(OFFSET):
            slope[:, k] = (self.moved(self._at + step * (number == k), likeliest) - here) / step[k]
        for axis in range(AXES):  # a press's place moves no other press: all are moved at once
            places = OFFSET + axis + AXES * np.arange(self.presses)
            moved = self.moved(self._at + step * np.isin(number, places), likeliest) - here
            for own, place in zip(self.columns, places, strict=True):
                slope[own, place] = moved[own] / step[place]
        return slope

    def residuals(self, at: Array) -> Array:
        """Return whitened residuals [..., S] at coordinates [..., 8 + 2 N], in their precision."""
        followed = (at - self._at.astype(at.dtype)) @ self._slope.T.astype(at.dtype)
        return super().residuals(at) + followed

    def residuals_and_jacobian(self, at: Array) -> tuple[Array, Array]:
        """Return the same [n, S] at coordinates [n, 8 + 2 N], and their derivatives [n, S, 8 + 2 N]."""
        residuals, jacobian = super().residuals_and_jacobian(at)
        return residuals + (at - self._at) @ self._slope.T, jacobian + self._slope
