"""Random presses to the surrogate: polynomials by least squares, near the inclusion and beside it.

Size and depth get nearly every product of theirs, since contact follows them steeply; skin and tissue little, and the
offset little near the inclusion. The error that counts is the one on presses kept apart.
"""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import HIGH, LOW, NUISANCES, PARAMETERS, normalise
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.legendre import LegendreSum, LegendreTerms
from device.measurement.ramp_modes.radial_profile import RESPONSE
from device.measurement.ramp_modes.surrogate import (
    HARMONICS,
    OFFSET,
    WAVES,
    PressRows,
    PressSurrogate,
    ScanSurrogate,
    direction_waves,
    inclusion_factor,
    offsets_in_range,
    polynomial_coordinates,
)
from host_tools.press_models.press_samples import BESIDE_TO_MM, PressSamples

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
BESIDE_REACH = INCLUSION_REACH | {"offset_mm": 8.2}
"""The same beside the inclusion, where the offset changes what is seen as much as size and depth do."""
TURNED_REACH = dict.fromkeys(PARAMETERS, 0.5) | {
    "size_mm": 9.0,
    "depth_mm": 8.0,
    "youngs_modulus_kpa": 2.4,
    "tissue_modulus_kpa": 1.6,
    "contact_pressure_kpa": 1.3,
    "spread_mm": 1.3,
    "offset_mm": 6.2,
}
"""The direction changes a press by a few per cent of itself: fewer terms say how much."""
AXIS_EVERY = 4
"""Every so many presses one is put on the axis."""
PRESSES_A_TERM = 3.0
"""Fewer presses than this a term, and the polynomials follow the noise of the tables."""


def fit_surrogate(near: PressSamples, beside: PressSamples, detail_ratio: float = 1.0) -> ScanSurrogate:
    """Return the surrogate of random presses, near the inclusion and beside it.

    `detail_ratio`: reach of the polynomials' degrees over that of the probe's own. Raises `InvalidQuantity` when they
    are too few or not finite.
    """
    return ScanSurrogate(
        _fitted(near, float(LOW[OFFSET]), float(HIGH[OFFSET]), INCLUSION_REACH, detail_ratio),
        _fitted(beside, float(HIGH[OFFSET]), BESIDE_TO_MM, BESIDE_REACH, detail_ratio),
    )


def _fitted(
    samples: PressSamples, from_mm: float, to_mm: float, reach: dict[str, float], detail_ratio: float
) -> PressSurrogate:
    at = offsets_in_range(polynomial_coordinates(normalise(samples.parameters), samples.parameters), from_mm, to_mm)
    reaches_axis = from_mm == float(LOW[OFFSET])
    fields = fit_polynomials(
        samples, at, reach, INCLUSION_HIGHEST, reaches_axis=reaches_axis, detail_ratio=detail_ratio
    )
    return PressSurrogate(*fields, from_mm, to_mm)


def fit_polynomials(
    samples: PressSamples,
    at: Array,
    reach: dict[str, float],
    highest: dict[str, int],
    *,
    reaches_axis: bool = True,
    detail_ratio: float = 1.0,
) -> tuple[LegendreSum, LegendreSum, LegendreSum]:
    """Return the polynomials of the inclusion, of what its direction adds, and of the baseline, for `at` [n, 9].

    `reach` and `highest` bound the inclusion's terms. Where offsets reach the axis, the first of coordinates, no
    direction matters there: few presses lie so near that they would say it. Raises as `fit_surrogate`.
    """
    inclusion_degrees, turned_degrees, baseline_degrees = (
        degrees(scaled(of_part, detail_ratio), most)
        for of_part, most in ((reach, highest), (TURNED_REACH, {}), (BASELINE_REACH, {}))
    )
    terms = len(inclusion_degrees) + len(WAVES) * len(turned_degrees)
    bound = Bound(PRESSES_A_TERM * terms, np.inf, "presses")
    require("presses", len(samples.rows), bound, "simulate more presses")
    require(
        "presses that are not finite",
        int((~np.isfinite(samples.rows)).any(axis=1).sum()),
        Bound(0, 0, ""),
        "leave them out",
    )
    factor, turned_terms = inclusion_factor(samples.parameters), LegendreTerms(turned_degrees).values(at)
    waves = direction_waves(samples.direction_rad)
    of_inclusion = LegendreTerms(inclusion_degrees).values(at)
    design = np.hstack([of_inclusion, *(turned_terms * wave[:, None] for wave in waves.T)])
    ends = np.cumsum((0, *HARMONICS))
    field = np.delete(samples.rows, np.arange(RESPONSE.start, RESPONSE.stop), axis=1)
    parts = [(design, factor[:, start], field[:, start:end]) for start, end in pairwise(ends)]
    if reaches_axis:
        parts[0] = _still_on_axis(parts[0], LegendreTerms(turned_degrees).values(_on_axis(at[::AXIS_EVERY])))
    fitted = np.hstack([_weighted(*part) for part in parts])
    inclusion, *turned = np.split(fitted, len(inclusion_degrees) + len(turned_degrees) * np.arange(len(WAVES)))
    baseline, *_ = np.linalg.lstsq(LegendreTerms(baseline_degrees).values(at), samples.rows[:, RESPONSE], rcond=None)
    return (
        LegendreSum(inclusion_degrees, inclusion),
        LegendreSum(turned_degrees, np.hstack(turned)),
        LegendreSum(baseline_degrees, np.asarray(baseline, np.float64)),
    )


def _on_axis(at: Array) -> Array:
    """Return coordinates [n, 9] with offsets of 0."""
    moved = np.array(at)
    moved[:, OFFSET] = -1.0
    return moved


def _still_on_axis(of_contrast: tuple[Array, Array, Array], turned_terms: Array) -> tuple[Array, Array, Array]:
    """Return design, weight and contrast with presses on the axis, to whose contrast no wave adds anything."""
    design, weight, contrast = of_contrast
    each_wave = np.kron(np.eye(len(WAVES)), turned_terms)
    of_inclusion = np.zeros((len(each_wave), design.shape[1] - each_wave.shape[1]))
    nothing = np.zeros((len(each_wave), contrast.shape[1]))
    strength = np.tile(weight[::AXIS_EVERY], len(WAVES))
    return (
        np.vstack([design, np.hstack([of_inclusion, each_wave])]),
        np.append(weight, strength),
        np.vstack([contrast, nothing]),
    )


def scaled(reach: dict[str, float], ratio: float) -> dict[str, float]:
    """Return reaches that are so many times as far; those below 1, which give no term, stay."""
    return {name: ratio * one if one >= 1 else one for name, one in reach.items()}


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


def held_out_error(surrogate: PressRows, samples: PressSamples) -> Array:
    """Return the root mean square error [P] of the profile's columns on presses that were kept apart."""
    return np.asarray(np.sqrt(np.mean(missed_rows(surrogate, samples) ** 2, axis=0)))


def missed_rows(surrogate: PressRows, samples: PressSamples) -> Array:
    """Return by how much a surrogate's rows [n, P] differ from those of presses."""
    return surrogate.rows(normalise(samples.parameters), samples.direction_rad) - samples.rows
