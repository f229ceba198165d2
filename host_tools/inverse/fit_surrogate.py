"""Random presses to the surrogate: which terms its polynomials have, and their least squares.

Size and depth get nearly every product of theirs, since contact follows them steeply; skin, tissue and offset little.
The error that counts is the one on presses kept apart.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from device.measurement.legendre import LegendreSum, terms
from device.measurement.press_parameters import NUISANCES, PARAMETERS, to_unit
from device.measurement.press_surrogate import (
    CONTRAST_COLUMNS,
    GROWTH_COLUMNS,
    PressSurrogate,
    lump_factor,
    polynomial_coordinates,
)
from device.measurement.quantities import UNKNOWNS, Bound, require
from host_tools.inverse.press_samples import Array, PressSamples

LUMP_REACH = {
    "size_mm": 18.0,
    "depth_mm": 16.0,
    "youngs_modulus_kpa": 4.2,
    "tissue_modulus_kpa": 2.6,
    "slab_thickness_mm": 2.1,
    "contact_pressure_kpa": 3.1,
    "albedo": 2.1,
    "spread_mm": 2.2,
    "offset_mm": 3.2,
}
"""A term counts when its degrees over these add up to at most 1."""
LUMP_HIGHEST = {"size_mm": 9, "depth_mm": 8}
BARE_REACH = dict.fromkeys(PARAMETERS, 0.5) | {
    "tissue_modulus_kpa": 4.0,
    "slab_thickness_mm": 4.0,
    "contact_pressure_kpa": 5.0,
    "albedo": 3.0,
    "spread_mm": 4.0,
}
PRESSES_A_TERM = 3.0
"""Fewer presses than this a term, and the polynomials follow the noise of the tables."""


def fit_surrogate(samples: PressSamples) -> PressSurrogate:
    """Return the surrogate of random presses; raises `InvalidQuantity` when they are too few or not finite."""
    at = polynomial_coordinates(to_unit(samples.parameters), samples.parameters)
    return PressSurrogate(*fit_polynomials(samples, at, LUMP_REACH, LUMP_HIGHEST))


def fit_polynomials(
    samples: PressSamples, at: Array, reach: dict[str, float], highest: dict[str, int]
) -> tuple[LegendreSum, LegendreSum]:
    """Return the polynomials of the lump, in terms of that reach, and of the lump-free light in coordinates [n, 9].

    Raises as `fit_surrogate`.
    """
    lump_degrees, bare_degrees = degrees(reach, highest), degrees(BARE_REACH, {})
    bound = Bound(PRESSES_A_TERM * len(lump_degrees), np.inf, "presses")
    require("presses", len(samples.rows), bound, "simulate more presses")
    require(
        "presses that are not finite",
        int((~np.isfinite(samples.rows)).any(axis=1).sum()),
        Bound(0, 0, ""),
        "leave them out",
    )
    contrast, growth, offset = np.split(samples.rows, [CONTRAST_COLUMNS, CONTRAST_COLUMNS + GROWTH_COLUMNS], axis=1)
    factor, design = lump_factor(samples.parameters), terms(lump_degrees, at)
    strength, placed = factor[:, 0], factor[:, -1]
    lump = [_weighted(design, strength, contrast), _weighted(design, placed, offset)]
    bare, *_ = np.linalg.lstsq(terms(bare_degrees, at), growth, rcond=None)
    return LegendreSum(lump_degrees, np.hstack(lump)), LegendreSum(bare_degrees, np.asarray(bare, np.float64))


def degrees(reach: dict[str, float], highest: dict[str, int]) -> NDArray[np.uint8]:
    """Return the degrees [M, 9] of all terms whose degrees over `reach` add up to at most 1."""
    limits = [range(min(int(reach[name]), highest.get(name, 99)) + 1) for name in PARAMETERS]
    of_nuisances = [k for k in product(*limits[len(UNKNOWNS) :]) if _part(k, NUISANCES, reach) <= 1]
    return np.array(
        [
            (*first, *k)
            for k in of_nuisances
            for first in product(*limits[: len(UNKNOWNS)])
            if _part(first, UNKNOWNS, reach) + _part(k, NUISANCES, reach) <= 1
        ],
        dtype=np.uint8,
    )


def held_out_error(surrogate: PressSurrogate, samples: PressSamples) -> Array:
    """Return the root mean square error [P] of the profile's columns on presses that were kept apart."""
    return np.asarray(np.sqrt(np.mean((surrogate.rows(to_unit(samples.parameters)) - samples.rows) ** 2, axis=0)))


def _part(k: tuple[int, ...], names: tuple[str, ...], reach: dict[str, float]) -> float:
    return sum(degree / reach[name] for degree, name in zip(k, names, strict=True)) - 1e-9


def _weighted(design: Array, weight: Array, rows: Array) -> Array:
    """Return least squares of rows = weight x (design x coefficients), so that errors count in the rows' own unit."""
    found, *_ = np.linalg.lstsq(weight[:, None] * design, rows, rcond=None)
    return np.asarray(found)
