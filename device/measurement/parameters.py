"""What a press depends on: the three unknowns, and the nuisances that nobody tells the probe.

Every model of a press - surrogate, networks, limits - takes them in this order and inside these ranges, of what is
possible in them: an inclusion is stiffer than its tissue and lies above the slab's base. That is also the prior:
nothing else is known before the probe touches. `offset_mm` is how far the inclusion's middle lies beside the probe's
axis.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import UNKNOWNS


class Range(NamedTuple):
    """Lowest, highest, and whether ratios count rather than differences: then its logarithm is evenly spread."""

    low: float
    high: float
    by_ratio: bool = False


RANGES: dict[str, Range] = {
    "size_mm": Range(2.0, 15.0),
    "depth_mm": Range(4.0, 12.0),
    "youngs_modulus_kpa": Range(10.0, 160.0, by_ratio=True),
    "tissue_modulus_kpa": Range(2.0, 30.0, by_ratio=True),
    "slab_thickness_mm": Range(15.0, 60.0, by_ratio=True),
    "contact_pressure_kpa": Range(1.5, 2.7, by_ratio=True),
    "albedo": Range(0.4, 0.6),
    "spread_mm": Range(0.8, 1.25, by_ratio=True),
    "offset_mm": Range(0.0, 2.0),
}
"""Tissue that people have; skin +-30 % in its contact law, +-20 % in its light."""
NEAR_NOMINAL = RANGES | {"tissue_modulus_kpa": Range(4.0, 6.0, True), "slab_thickness_mm": Range(27.0, 33.0, True)}
"""The same near the nominal tissue, where stiffer and softer deep tissue was solved."""
ELASTIC_MISMATCHES = (0.1, 0.96)
"""Of an inclusion with its tissue: from 1.3 to 61 times as stiff. What is softer does not show as an inclusion."""
ABOVE_BASE_MM = 1.0
"""An inclusion ends at least this far above the slab's base."""
LAYER_TOPS_MM = 0.0, 4.0, 8.0, 12.0, 20.0
"""Depths at which the layers of uneven tissue begin; each ends where the next begins, the last at the base."""
PARAMETERS = tuple(RANGES)
COUNT = len(UNKNOWNS)
NUISANCES = PARAMETERS[COUNT:]
LOW: Array = np.array([entry.low for entry in RANGES.values()])
HIGH: Array = np.array([entry.high for entry in RANGES.values()])
BY_RATIO = np.array([entry.by_ratio for entry in RANGES.values()])
EVEN_STD = 3**-0.5
"""Standard deviation of a coordinate that is even between -1 and 1."""
NOMINAL = {
    "tissue_modulus_kpa": 5.0,
    "slab_thickness_mm": 30.0,
    "contact_pressure_kpa": 2.0,
    "albedo": 0.5,
    "spread_mm": 1.0,
    "offset_mm": 0.0,
}


def elastic_mismatch(modulus_kpa: Array, tissue_kpa: Array) -> Array:
    """Return (E - Et) / (E + 3/2 Et), the dipole strength of an incompressible sphere (Eshelby 1957)."""
    return np.asarray((modulus_kpa - tissue_kpa) / (modulus_kpa + 1.5 * tissue_kpa))


def modulus_ratio(mismatch: float) -> float:
    """Return the modulus of an inclusion of a mismatch below 1, over its tissue's."""
    return (1 + 1.5 * mismatch) / (1 - mismatch)


def is_possible(values: Array) -> NDArray[np.bool_]:
    """Return whether parameters [..., 9] are of an inclusion stiffer than its tissue that lies above the base."""
    size_mm, depth_mm, modulus_kpa, tissue_kpa, slab_mm = np.moveaxis(values, -1, 0)[: COUNT + 2]
    mismatch, (least, most) = elastic_mismatch(modulus_kpa, tissue_kpa), ELASTIC_MISMATCHES
    is_above = size_mm + depth_mm <= slab_mm - ABOVE_BASE_MM
    return np.asarray((least <= mismatch) & (mismatch <= most) & is_above)


def normalise(values: Array) -> Array:
    """Return parameters [..., 9] as coordinates that are -1 and 1 at the ends of their ranges."""
    low, high = _evenly(LOW), _evenly(HIGH)
    return np.asarray(2 * (_evenly(values) - low) / (high - low) - 1)


def denormalise(normalised: Array) -> Array:
    """Return parameters [..., 9] of coordinates; the inverse of `normalise`, and exact at the ends of the ranges."""
    low, high = _evenly(LOW), _evenly(HIGH)
    values = low + (normalised + 1) / 2 * (high - low)
    values[..., BY_RATIO] = np.exp(values[..., BY_RATIO])
    return np.where(normalised == -1, LOW, np.where(normalised == 1, HIGH, values))


class Box(NamedTuple):
    """Middle and half width [9] of ranges, in coordinates."""

    middle: Array
    half: Array


def box_of(ranges: dict[str, Range]) -> Box:
    """Return where ranges lie, by the name of each parameter; that of `RANGES` is 0 and 1."""
    low, high = (normalise(np.array([getattr(ranges[name], end) for name in RANGES])) for end in ("low", "high"))
    return Box((low + high) / 2, (high - low) / 2)


def normalise_unknowns(values: Array) -> Array:
    """Return size, depth and modulus [..., 3] as coordinates."""
    others = np.broadcast_to(HIGH[COUNT:], (*values.shape[:-1], len(NUISANCES)))
    return normalise(np.concatenate([values, others], axis=-1))[..., :COUNT]


def denormalise_unknowns(normalised: Array) -> Array:
    """Return size, depth and modulus [..., 3] of coordinates."""
    others = np.zeros((*normalised.shape[:-1], len(NUISANCES)))
    return denormalise(np.concatenate([normalised, others], axis=-1))[..., :COUNT]


def slope_of_normalised(values: Array) -> Array:
    """Return d(parameters) / d(coordinates) [..., 9]."""
    half = (_evenly(HIGH) - _evenly(LOW)) / 2
    return np.asarray(np.where(BY_RATIO, values * half, half))


def _evenly(values: Array) -> Array:
    """Return parameters with the logarithm of those whose ratios count."""
    spread = np.array(values, dtype=np.float64)
    spread[..., BY_RATIO] = np.log(spread[..., BY_RATIO])
    return spread
