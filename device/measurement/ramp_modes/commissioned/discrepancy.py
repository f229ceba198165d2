"""What a probe's forward model lacks and no direction carries: an error of its light that depends on skin and tissue.

In contrast and harmonics it is a ratio of what the inclusion does thereabouts, in the reference response one of the
light; a smooth function of ring and force, times 1 and each coordinate of skin and tissue. So shows a probe whose
optics follow another law than the design's.
Source: Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001), model discrepancy; docs/own_probe.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import PARAMETERS
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.commissioned.row_derivatives import owned_by
from device.measurement.ramp_modes.radial_profile import COLUMNS, CONTRAST, FIRST, FORCES, SECOND
from device.measurement.recording.ring_means import RING_RADII_MM

KNOWN_BY = tuple(
    PARAMETERS.index(name) for name in ("tissue_modulus_kpa", "contact_pressure_kpa", "albedo", "spread_mm")
)
"""Coordinates with each of which the error changes evenly."""
PARTS = 1 + len(KNOWN_BY)
PROBES = len(owned_by("probe"))
ALIKE_MM = 4.0
"""Over so many millimetres, a standard deviation, an inclusion's effect on neighbouring rings counts together: where
it changes its sign, the error does not vanish."""


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """`mean` [PARTS, P] of the error, and its covariance by factors: `factor` [PARTS, P, R] and `of_probe` [D, R].

    The latter says how the D directions of the probe go with it: both were told by the same phantoms. R is 0 where the
    forward model is believed to lack nothing. Raises `InvalidQuantity` for arrays of another shape.
    """

    mean: Array
    factor: Array
    of_probe: Array

    def __post_init__(self) -> None:
        rank = self.factor.shape[-1]
        for name, expected in (
            ("mean", (PARTS, COLUMNS)),
            ("factor", (PARTS, COLUMNS, rank)),
            ("of_probe", (PROBES, rank)),
        ):
            if (found := getattr(self, name).shape) != expected:
                action = "commission the probe again"
                raise InvalidQuantity(f"shape of the discrepancy's {name}", found, str(expected), action)

    def shift(self, normalised: Array, rows: Array) -> Array:
        """Return what is believed to move rows [n, P] at coordinates [n, 9]."""
        return np.asarray(error_sizes(rows) * (by_skin_and_tissue(normalised) @ self.mean))

    def spread(self, normalised: Array, rows: Array) -> Array:
        """Return a factor [n, P, R] of the covariance of what moves them."""
        of_parts = np.tensordot(by_skin_and_tissue(normalised), self.factor, 1)
        return np.asarray(error_sizes(rows)[..., None] * of_parts)


NOTHING = Discrepancy(np.zeros((PARTS, COLUMNS)), np.zeros((PARTS, COLUMNS, 0)), np.zeros((PROBES, 0)))


def by_skin_and_tissue(normalised: Array) -> Array:
    """Return by how much each part of the error counts [n, PARTS], at coordinates [n, 9]."""
    return np.column_stack([np.ones(len(normalised)), normalised[:, list(KNOWN_BY)]])


def error_sizes(rows: Array) -> Array:
    """Return what an error of 1 is [n, P] in rows [n, P]: the inclusion's effect thereabouts, 1 in the response."""
    sizes = np.ones_like(rows)
    for columns, first, last in ((CONTRAST, 0, 0), (FIRST, 1, 0), (SECOND, 1, 1)):
        rings = RING_RADII_MM[first : len(RING_RADII_MM) - last]
        weight = np.exp(-((rings[:, None] - rings) ** 2) / (2 * ALIKE_MM**2))
        weight /= weight.sum(axis=1, keepdims=True)
        squares = rows[:, columns].reshape(len(rows), FORCES, -1) ** 2
        sizes[:, columns] = np.sqrt(squares @ weight.T).reshape(len(rows), -1)
    return sizes
