"""Random presses to the surrogate: polynomials by least squares, near the inclusion and beside it.

Products of high degree in several parameters are thousands, and most of them add nothing. All are tried; those that
add least to the rows are left out, a part at a time, and the others fitted anew. A third of the terms that size, depth
and tissue seem to need at first miss as little: the fit that a person waits for costs as many products less.
Source: Blatman & Sudret, J. Comput. Phys. 230 (2011), sparse polynomial chaos; leaving out is backward elimination.
The error that counts is the one on presses kept apart.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    "youngs_modulus_kpa": 5.7,
    "tissue_modulus_kpa": 8.4,
    "slab_thickness_mm": 5.7,
    "contact_pressure_kpa": 4.2,
    "albedo": 2.9,
    "spread_mm": 3.0,
    "offset_mm": 4.4,
}
"""A term is tried when its degrees over these add up to at most 1."""
INCLUSION_HIGHEST = {"size_mm": 10, "depth_mm": 9}
BASELINE_REACH = dict.fromkeys(PARAMETERS, 0.5) | {
    "tissue_modulus_kpa": 15.0,
    "slab_thickness_mm": 8.0,
    "contact_pressure_kpa": 7.0,
    "albedo": 4.0,
    "spread_mm": 5.0,
}
BESIDE_REACH = INCLUSION_REACH | {"offset_mm": 8.2}
"""The same beside the inclusion, where the offset changes what is seen as much as size and depth do."""
TURNED_REACH = dict.fromkeys(PARAMETERS, 0.5) | {
    "size_mm": 9.0,
    "depth_mm": 8.0,
    "youngs_modulus_kpa": 2.4,
    "tissue_modulus_kpa": 2.6,
    "contact_pressure_kpa": 1.3,
    "spread_mm": 1.3,
    "offset_mm": 6.2,
}
"""The direction changes a press by a few per cent of itself: fewer terms say how much."""
AXIS_EVERY = 4
"""Every so many presses one is put on the axis."""
PRESSES_A_TERM = 3.0
"""Fewer presses than this a term that is tried, and the polynomials follow the noise of the tables."""
TERMS, BESIDE_TERMS, BASELINE_TERMS = 1100, 1400, 250
"""Terms that are kept of the inclusion, near it and beside it, and of the baseline.

With more, presses kept apart are met hardly better.
"""
LEFT_OUT_AT_ONCE, RIDGE = 0.15, 1e-10
"""Part of the terms that is left out before the others are fitted anew; terms that are alike are held to 0 a little."""


def fit_surrogate(near: PressSamples, beside: PressSamples, detail_ratio: float = 1.0) -> ScanSurrogate:
    """Return the surrogate of random presses, near the inclusion and beside it.

    `detail_ratio`: reach of the polynomials' degrees over that of the probe's own. Raises `InvalidQuantity` when they
    are too few or not finite.
    """
    return ScanSurrogate(
        _fitted(near, (float(LOW[OFFSET]), float(HIGH[OFFSET])), INCLUSION_REACH, TERMS, detail_ratio),
        _fitted(beside, (float(HIGH[OFFSET]), BESIDE_TO_MM), BESIDE_REACH, BESIDE_TERMS, detail_ratio),
    )


def _fitted(
    samples: PressSamples, ends_mm: tuple[float, float], reach: dict[str, float], terms: int, detail_ratio: float
) -> PressSurrogate:
    at = offsets_in_range(polynomial_coordinates(normalise(samples.parameters), samples.parameters), *ends_mm)
    fields = fit_polynomials(
        samples,
        at,
        reach,
        INCLUSION_HIGHEST,
        terms=terms,
        reaches_axis=ends_mm[0] == float(LOW[OFFSET]),
        detail_ratio=detail_ratio,
    )
    return PressSurrogate(*fields, *ends_mm)


def fit_polynomials(
    samples: PressSamples,
    at: Array,
    reach: dict[str, float],
    highest: dict[str, int],
    *,
    terms: int,
    reaches_axis: bool = True,
    detail_ratio: float = 1.0,
) -> tuple[LegendreSum, LegendreSum, LegendreSum]:
    """Return the polynomials of the inclusion, of what its direction adds, and of the baseline, for `at` [n, 9].

    `reach` and `highest` bound the inclusion's terms that are tried, `terms` how many are kept. Where offsets reach the
    axis, the first of coordinates, no direction matters there: few presses lie so near that they would say it. Raises
    as `fit_surrogate`.
    """
    tried_degrees = degrees(scaled(reach, detail_ratio), highest)
    turned_degrees = degrees(scaled(TURNED_REACH, detail_ratio), {})
    _require_enough(samples, len(tried_degrees) + len(WAVES) * len(turned_degrees))
    turned_terms, waves = LegendreTerms(turned_degrees).values(at), direction_waves(samples.direction_rad)
    of_waves = np.hstack([turned_terms * wave[:, None] for wave in waves.T])
    parts = list(_weighted_fields(samples))
    tried = np.hstack([LegendreTerms(tried_degrees).values(at), of_waves])
    inclusion_degrees = tried_degrees[_terms_that_matter(tried, parts, len(tried_degrees), terms)]
    design = np.hstack([LegendreTerms(inclusion_degrees).values(at), of_waves])
    equations = [(design, *part) for part in parts]
    if reaches_axis:
        equations[0] = _still_on_axis(equations[0], LegendreTerms(turned_degrees).values(_on_axis(at[::AXIS_EVERY])))
    fitted = np.hstack([_weighted(*one) for one in equations])
    inclusion, *turned = np.split(fitted, len(inclusion_degrees) + len(turned_degrees) * np.arange(len(WAVES)))
    baseline = _fitted_baseline(degrees(scaled(BASELINE_REACH, detail_ratio), {}), at, samples.rows[:, RESPONSE])
    return LegendreSum(inclusion_degrees, inclusion), LegendreSum(turned_degrees, np.hstack(turned)), baseline


def _fitted_baseline(tried: NDArray[np.uint8], at: Array, response: Array) -> LegendreSum:
    design, everywhere = LegendreTerms(tried).values(at), np.ones(len(at))
    kept = _terms_that_matter(design, [(everywhere, response)], len(tried), BASELINE_TERMS)
    return LegendreSum(tried[kept], _weighted(design[:, kept], everywhere, response))


def _require_enough(samples: PressSamples, terms: int) -> None:
    bound = Bound(PRESSES_A_TERM * terms, np.inf, "presses")
    require("presses", len(samples.rows), bound, "simulate more presses")
    require(
        "presses that are not finite",
        int((~np.isfinite(samples.rows)).any(axis=1).sum()),
        Bound(0, 0, ""),
        "leave them out",
    )


def _weighted_fields(samples: PressSamples) -> Iterator[tuple[Array, Array]]:
    """Yield factor [n] and columns [n, Q] of the contrast, of its first harmonic and of its second."""
    factor, ends = inclusion_factor(samples.parameters), np.cumsum((0, *HARMONICS))
    field = np.delete(samples.rows, np.arange(RESPONSE.start, RESPONSE.stop), axis=1)
    for start, end in pairwise(ends):
        yield factor[:, start], field[:, start:end]


def _terms_that_matter(tried: Array, parts: Sequence[tuple[Array, Array]], count: int, most: int) -> NDArray[np.intp]:
    """Return which of the first `count` terms of a design [n, M] are kept: so many that move the rows most.

    What a term adds to the rows, as a mean square, is told anew after each part of them is left out.
    """
    systems = [_normal_equations(weight[:, None] * tried, rows) for weight, rows in parts]
    others, kept = np.arange(count, tried.shape[1]), np.arange(count)
    while len(kept) > most:
        at = np.append(kept, others)
        added = np.zeros(len(at))
        for products, of_rows in systems:
            held = products[np.ix_(at, at)]
            squares = np.diagonal(held).copy()
            held[np.diag_indices(len(at))] += RIDGE * squares.mean()
            added += squares * (np.linalg.solve(held, of_rows[at]) ** 2).sum(axis=1)
        leave = min(max(round(LEFT_OUT_AT_ONCE * len(kept)), 1), len(kept) - most)
        kept = np.sort(kept[np.argsort(added[: len(kept)], kind="stable")[leave:]])
    return kept


def _normal_equations(design: Array, rows: Array) -> tuple[Array, Array]:
    return design.T @ design, design.T @ rows


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
