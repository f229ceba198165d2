"""A face to rings around its axis: means over them, how many pixels see them, and how smooth errors couple them.

Rings are 0.3 mm wide and end with the central window. The camera sees less of the outer ones: its picture is wider
than high.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ive

from device.measurement.arrays import Array
from host_tools.scenes.probe_file import simulated_probe

RING_MM = 0.3


@dataclass(frozen=True, eq=False)
class Rings:
    """`edges_mm` [K + 1] of K rings."""

    edges_mm: Array

    @classmethod
    def within(cls, radius_mm: float) -> Rings:
        """Return rings of some `RING_MM` from the axis to a radius."""
        return cls(np.linspace(0.0, radius_mm, round(radius_mm / RING_MM) + 1))

    @property
    def r_mm(self) -> Array:
        """Middles of the rings [K]."""
        return np.asarray((self.edges_mm[1:] + self.edges_mm[:-1]) / 2)

    @property
    def area_mm2(self) -> Array:
        """Areas of the rings [K]."""
        return np.asarray(np.pi * np.diff(self.edges_mm**2))

    @property
    def pixels(self) -> Array:
        """Number of pixels that see each ring [K]; a fraction where the picture cuts the ring."""
        camera = simulated_probe().camera
        sides = (camera.width_px, camera.mm_per_px_x), (camera.height_px, camera.mm_per_px_y)
        x, y = ((np.arange(n) + 0.5 - n / 2) * step for n, step in sides)
        from_axis_mm = np.hypot(x[None, :], y[:, None])
        return np.histogram(from_axis_mm, self.edges_mm)[0].astype(float)

    def of_profile(self, r_mm: Array, profile: Array) -> Array:
        """Return the means [..., K] of profiles [..., R] whose radii ascend from 0 and reach beyond the rings."""
        return mean_between(r_mm, profile, self.edges_mm[:-1], self.edges_mm[1:])

    def of_map(self, from_axis_mm: NDArray[np.floating], values: NDArray[np.floating]) -> Array:
        """Return the means [K] of a map [ny, nx] whose points lie so far from the axis."""
        ring = np.digitize(from_axis_mm.ravel(), self.edges_mm)
        total = np.bincount(ring, values.ravel().astype(float), len(self.edges_mm) + 1)
        return np.asarray(total[1:-1] / np.bincount(ring, minlength=len(self.edges_mm) + 1)[1:-1])

    def coupling(self, correlation_mm: float, harmonic: int = 0) -> Array:
        """Return the covariance [K, K] between rings of a harmonic of a smooth error of variance 1.

        The error's correlation falls off as a Gaussian of the distance; over the angle between two points that has
        Bessel functions for harmonics. Harmonic m is the amplitude of cos(m angle), so from m = 1 on it counts twice.
        """
        r, s = self.r_mm[:, None] / correlation_mm, self.r_mm[None, :] / correlation_mm
        once = ive(harmonic, r * s) * np.exp(-((r - s) ** 2) / 2)
        return np.asarray(once if harmonic == 0 else 2 * once)


def mean_between(r_mm: Array, profile: Array, inner_mm: Array, outer_mm: Array) -> Array:
    """Return means [..., K] of profiles [..., R] over rings between K radii; profiles are straight between samples."""
    slope = np.diff(profile) / np.diff(r_mm)
    start = profile[..., :-1] - slope * r_mm[:-1]
    pieces = start * np.diff(r_mm**2) / 2 + slope * np.diff(r_mm**3) / 3
    whole = np.cumsum(pieces, axis=-1) - pieces  # up to the beginning of each piece

    def up_to(edge_mm: Array) -> Array:
        i = np.clip(np.searchsorted(r_mm, edge_mm, side="right") - 1, 0, len(r_mm) - 2)
        a, b = start[..., i], slope[..., i]
        return np.asarray(whole[..., i] + a * (edge_mm**2 - r_mm[i] ** 2) / 2 + b * (edge_mm**3 - r_mm[i] ** 3) / 3)

    return np.asarray((up_to(outer_mm) - up_to(inner_mm)) * 2 / (outer_mm**2 - inner_mm**2))
