"""Random presses to the surrogate and to the second harmonics of round inclusions: polynomials by least squares.

Size and depth get nearly every product of theirs, since contact follows them steeply; skin, tissue and offset little.
The offset is the reason of a second harmonic and enters by its square; the rest bends it little. The error that counts
is the one on presses kept apart: for second harmonics against the 1e-3 that flat field and model leave open.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import NUISANCES, PARAMETERS, normalise
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.ellipticity import EllipticityTest, second_factor
from device.measurement.ramp_modes.legendre import LegendreSum, LegendreTerms
from device.measurement.ramp_modes.surrogate import (
    CONTRAST_COLUMNS,
    RESPONSE_COLUMNS,
    PressSurrogate,
    inclusion_factor,
    polynomial_coordinates,
)
from host_tools.press_models.press_samples import PressSamples

INCLUSION_REACH = {
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
INCLUSION_HIGHEST = {"size_mm": 9, "depth_mm": 8}
BASELINE_REACH = dict.fromkeys(PARAMETERS, 0.5) | {
    "tissue_modulus_kpa": 4.0,
    "slab_thickness_mm": 4.0,
    "contact_pressure_kpa": 5.0,
    "albedo": 3.0,
    "spread_mm": 4.0,
}
SECOND_REACH = {
    "size_mm": 12.0,
    "depth_mm": 11.0,
    "youngs_modulus_kpa": 3.2,
    "tissue_modulus_kpa": 2.1,
    "slab_thickness_mm": 1.1,
    "contact_pressure_kpa": 2.1,
    "albedo": 1.1,
    "spread_mm": 1.6,
    "offset_mm": 3.2,
}
"""The same for second harmonics."""
SECOND_HIGHEST = {"size_mm": 7, "depth_mm": 6}
PRESSES_A_TERM = 3.0
"""Fewer presses than this a term, and the polynomials follow the noise of the tables."""


def fit_surrogate(samples: PressSamples) -> PressSurrogate:
    """Return the surrogate of random presses; raises `InvalidQuantity` when they are too few or not finite."""
    at = polynomial_coordinates(normalise(samples.parameters), samples.parameters)
    return PressSurrogate(*fit_polynomials(samples, at, INCLUSION_REACH, INCLUSION_HIGHEST))


def fit_polynomials(
    samples: PressSamples, at: Array, reach: dict[str, float], highest: dict[str, int]
) -> tuple[LegendreSum, LegendreSum]:
    """Return the polynomials of the inclusion and of the baseline, for coordinates `at` [n, 9].

    `reach` and `highest` bound the inclusion's terms. Raises as `fit_surrogate`.
    """
    inclusion_degrees, baseline_degrees = degrees(reach, highest), degrees(BASELINE_REACH, {})
    bound = Bound(PRESSES_A_TERM * len(inclusion_degrees), np.inf, "presses")
    require("presses", len(samples.rows), bound, "simulate more presses")
    require(
        "presses that are not finite",
        int((~np.isfinite(samples.rows)).any(axis=1).sum()),
        Bound(0, 0, ""),
        "leave them out",
    )
    contrast, reference_response, offset = np.split(
        samples.rows, [CONTRAST_COLUMNS, CONTRAST_COLUMNS + RESPONSE_COLUMNS], axis=1
    )
    factor, design = inclusion_factor(samples.parameters), LegendreTerms(inclusion_degrees).values(at)
    strength, placed = factor[:, 0], factor[:, -1]
    inclusion = [_weighted(design, strength, contrast), _weighted(design, placed, offset)]
    baseline, *_ = np.linalg.lstsq(LegendreTerms(baseline_degrees).values(at), reference_response, rcond=None)
    return LegendreSum(inclusion_degrees, np.hstack(inclusion)), LegendreSum(
        baseline_degrees, np.asarray(baseline, np.float64)
    )


def fit_second_harmonics(samples: PressSamples) -> LegendreSum:
    """Return polynomials [9] to [Q] of `EllipticityTest`; raises `InvalidQuantity` when the presses are too few."""
    found = degrees(SECOND_REACH, SECOND_HIGHEST)
    bound = Bound(PRESSES_A_TERM * len(found), np.inf, "presses")
    require("presses", len(samples.rows), bound, "simulate more presses")
    at = polynomial_coordinates(normalise(samples.parameters), samples.parameters)
    design = second_factor(samples.parameters)[:, None] * LegendreTerms(found).values(at)
    coefficients, *_ = np.linalg.lstsq(design, samples.second_harmonics, rcond=None)
    return LegendreSum(found, np.asarray(coefficients))


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


def _part(k: tuple[int, ...], names: tuple[str, ...], reach: dict[str, float]) -> float:
    return sum(degree / reach[name] for degree, name in zip(k, names, strict=True)) - 1e-9


def _weighted(design: Array, weight: Array, rows: Array) -> Array:
    """Return least squares of rows = weight x (design x coefficients), so that errors count in the rows' own unit."""
    found, *_ = np.linalg.lstsq(weight[:, None] * design, rows, rcond=None)
    return np.asarray(found)


def held_out_error(surrogate: PressSurrogate, samples: PressSamples) -> Array:
    """Return the root mean square error [P] of the profile's columns on presses that were kept apart."""
    return np.asarray(np.sqrt(np.mean((surrogate.rows(normalise(samples.parameters)) - samples.rows) ** 2, axis=0)))


def held_out_second_harmonics(ellipticity: EllipticityTest, samples: PressSamples) -> Array:
    """Return the root mean square error [Q] of second harmonics on presses that were kept apart."""
    errors = ellipticity.second_harmonics(normalise(samples.parameters)) - samples.second_harmonics
    return np.asarray(np.sqrt(np.mean(errors**2, axis=0)))
