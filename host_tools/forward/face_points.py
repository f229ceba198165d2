"""A field on the rays of a face to its values at any points of the face: the pixels of a picture, or a map.

Straight between the samples of a ray. Around a round face a periodic spline goes from ray to ray, because straight
lines between rays 7.5 degrees apart would show as spokes; around a square one, whose fields bend at the corners, they
are straight along its sides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.ndimage import map_coordinates

from device.measurement.arrays import Array
from host_tools.forward.face_state import Rays

TURN_STEPS = 720
"""Steps of a full turn between which a field is straight: half a degree, 0.1 mm at the rim of the default face."""


class FacePoints:
    """Points of a face; call it with a field [A, R] of the rays. `is_inside` tells which points lie on the face."""

    def __init__(self, rays: Rays, x_mm: NDArray[np.floating], y_mm: NDArray[np.floating]) -> None:
        """`x_mm` and `y_mm` broadcast against each other to the shape of all that is returned."""
        x, y = np.broadcast_arrays(x_mm, y_mm)
        self._from_axis_mm, self._rays = np.hypot(x, y), rays
        if self._is_axisymmetric:
            self.is_inside: NDArray[np.bool_] = self._from_axis_mm <= rays.r_mm[0, -1]
            return
        turned = np.arctan2(y, x) - rays.angle_rad[0]
        steps = turned / (2 * np.pi) % 1 * TURN_STEPS
        reach_mm = map_coordinates(_reach_mm(rays), [steps], order=1, mode="grid-wrap")
        self.is_inside = self._from_axis_mm <= reach_mm
        samples = np.minimum(self._from_axis_mm / reach_mm, 1) * (rays.r_mm.shape[1] - 1)
        self._places = [steps, samples]

    def __call__(self, field: Array) -> Array:
        """Return the field at the points; beyond the rim it keeps the rim's value."""
        if self._is_axisymmetric:
            return np.asarray(np.interp(self._from_axis_mm, self._rays.r_mm[0], field[0]))
        return np.asarray(map_coordinates(_all_round(self._rays, field), self._places, order=1, mode="grid-wrap"))

    @property
    def _is_axisymmetric(self) -> bool:
        return len(self._rays.angle_rad) == 1


def _all_round(rays: Rays, field: Array) -> Array:
    """Return a field [A, R] at every step of a turn [TURN_STEPS, R], the first at the first ray."""
    closed = np.concatenate([field, field[:1]])
    if _is_round(rays):
        turns = np.linspace(0, 1, len(closed))
        return np.asarray(CubicSpline(turns, closed, bc_type="periodic")(np.arange(TURN_STEPS) / TURN_STEPS))
    low, before, after = _along_edge(rays)
    share = (after / (before + after))[:, None]
    return np.asarray((1 - share) * closed[low] + share * closed[low + 1])


def _reach_mm(rays: Rays) -> Array:
    """Return how far the face reaches at every step of a turn [TURN_STEPS]."""
    if _is_round(rays):
        return np.full(TURN_STEPS, rays.r_mm[0, -1])
    _, before, after = _along_edge(rays)
    return np.asarray(np.sin(2 * np.pi / len(rays.r_mm)) / (before + after))


def _is_round(rays: Rays) -> bool:
    """Return whether all rays reach equally far."""
    reach_mm = rays.r_mm[:, -1]
    return bool(np.ptp(reach_mm) < 1e-9 * reach_mm[0])


def _along_edge(rays: Rays) -> tuple[NDArray[np.int64], Array, Array]:
    """Return for every step the ray before it, and how near it is to that ray and to the one after, in 1/mm.

    Both are the weights of the two rays' ends on a straight edge between them, where 1/r is linear in the cosine and
    the sine of the angle.
    """
    ends, apart = rays.r_mm[:, -1], 2 * np.pi / len(rays.r_mm)
    place = np.arange(TURN_STEPS) * len(ends) / TURN_STEPS
    low = place.astype(np.int64)
    past = (place - low) * apart
    return low, np.sin(apart - past) / ends[low], np.sin(past) / ends[(low + 1) % len(ends)]
