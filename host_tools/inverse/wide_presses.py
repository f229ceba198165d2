"""Random presses of lumps in and around the trained ranges, to rows of the press profile.

As `press_samples` and `fit_surrogate`, with a size and depth that may lie outside: polynomials over the wide ranges,
in the same terms. Only what may lie inside or outside is drawn wide; the modulus and all that nobody tells the probe
stay in their ranges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.legendre import LegendreSum
from device.measurement.press_parameters import PARAMETERS, to_unit
from device.measurement.press_surrogate import DEPTH, SIZE, assemble, lump_factor, polynomial_coordinates
from host_tools.inverse.dense_network import Single
from host_tools.inverse.press_samples import NEAREST_MM, Array, draw_parameters
from host_tools.wide_table import SHALLOWEST_MM, SIZES_MM, deepest_mm

SIZES, DEPTHS = (1.5, SIZES_MM[1]), (SHALLOWEST_MM, deepest_mm(1.5))
"""Wide ranges of size and depth, mm; smaller lumps show nowhere."""
PLACE = slice(SIZE, DEPTH + 1)
THICKNESS = PARAMETERS.index("slab_thickness_mm")
ENDS: Array = np.array([SIZES, DEPTHS])


def draw_wide_parameters(count: int, rng: np.random.Generator, *, lumps_a_skin: int = 1) -> Array:
    """Return parameters [count, 9] as `press_samples.draw_parameters`, size and depth even over the wide ranges."""
    values = draw_parameters(count, rng, lumps_a_skin=lumps_a_skin)
    again = np.full(count, True)
    while again.any():
        values[again, PLACE] = rng.uniform(ENDS[:, 0], ENDS[:, 1], (int(again.sum()), 2))
        size_mm, depth_mm = values[:, PLACE].T
        deepest = np.minimum([deepest_mm(size) for size in size_mm], values[:, THICKNESS] - NEAREST_MM - size_mm)
        again = depth_mm > deepest
    return values


def is_outside(unit: Array | Single) -> NDArray[np.bool_]:
    """Return whether size or depth lies outside its trained range [n], for coordinates [n, 9] of `to_unit`."""
    return np.asarray((np.abs(unit[:, PLACE]) > 1).any(axis=1))


def wide_coordinates(parameters: Array) -> Array:
    """Return the coordinates [n, 9] in which wide presses are polynomials: -1 to 1 over the wide ranges."""
    at = polynomial_coordinates(to_unit(parameters), parameters)
    low, high = ENDS.T
    at[:, PLACE] = 2 * (parameters[:, PLACE] - low) / (high - low) - 1
    return at


@dataclass(frozen=True, eq=False)
class WideSurrogate:
    """`press_surrogate.PressSurrogate` over the wide ranges."""

    lump: LegendreSum
    bare: LegendreSum

    def rows(self, parameters: Array) -> Array:
        """Return profile rows [n, P] at parameters [n, 9]."""
        at = wide_coordinates(parameters)
        return assemble(lump_factor(parameters) * self.lump.values(at), self.bare.values(at))
