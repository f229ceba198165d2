"""The forward model of a press in a millisecond: unknowns and nuisances to the row of the press profile.

Polynomials in nine parameters, fitted to simulated presses by `host_tools train`. What is polynomial is the contrast
over size^3 / distance^3, the strength of a small sphere far away, and the modulus enters by Eshelby's mismatch: both
take out what no polynomial follows well. Differentiable, so that a press can be fitted by Gauss-Newton. A press beside
the inclusion has polynomials of its own. In which direction the inclusion lies matters, too, and the image says it:
four LEDs light the face alike after a quarter of a turn, the frame's edges after half of one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import (
    ELASTIC_MISMATCHES,
    HIGH,
    LOW,
    PARAMETERS,
    denormalise,
    elastic_mismatch,
    slope_of_normalised,
)
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.radial_profile import COLUMN_COUNTS, COLUMNS

SIZE, DEPTH, MODULUS, TISSUE, OFFSET = (
    PARAMETERS.index(name) for name in ("size_mm", "depth_mm", "youngs_modulus_kpa", "tissue_modulus_kpa", "offset_mm")
)
Number = TypeVar("Number", float, Array)
CONTRAST_COLUMNS, RESPONSE_COLUMNS, FIRST_COLUMNS, SECOND_COLUMNS = COLUMN_COUNTS
INCLUSION_COLUMNS = COLUMNS - RESPONSE_COLUMNS
HARMONICS = CONTRAST_COLUMNS, FIRST_COLUMNS, SECOND_COLUMNS
"""Columns of the inclusion's field, by the order of the harmonic."""
WAVES = np.array([2.0, 4.0])
"""Orders of the direction's waves: the frame's edges, and the four LEDs."""
ARRAYS = (
    "lump_degrees",
    "lump_coefficients",
    "turned_degrees",
    "turned_coefficients",
    "bare_degrees",
    "bare_coefficients",
)


@dataclass(frozen=True, eq=False)
class PressSurrogate:
    """`inclusion_field`: contrast and harmonics over `inclusion_factor`, mean over all directions of the inclusion.

    `turned_field`: what each wave of the direction adds to it. `baseline`: reference force response. All hold for
    offsets `from_mm` to `to_mm`.
    """

    inclusion_field: LegendreSum
    turned_field: LegendreSum
    baseline: LegendreSum
    from_mm: float = float(LOW[OFFSET])
    to_mm: float = float(HIGH[OFFSET])

    def rows(self, normalised: Array, direction_rad: Array | None = None) -> Array:
        """Return profile rows [n, P] at coordinates [n, 9] of `parameters.normalise`; directions as in `PressRows`."""
        parameters = denormalise(normalised)
        at = self.coordinates(normalised, parameters).astype(normalised.dtype)
        inclusion = self.inclusion_field.values(at)
        if direction_rad is not None:
            inclusion += turned(self.turned_field.values(at), direction_rad)
        inclusion *= inclusion_factor(parameters)
        return assemble(inclusion, self.baseline.values(at))

    def rows_and_jacobian(self, normalised: Array, direction_rad: Array | None = None) -> tuple[Array, Array]:
        """Return the rows [n, P] at coordinates [n, 9] and their derivatives [n, P, 9] by them."""
        parameters = denormalise(normalised)
        at = self.coordinates(normalised, parameters)
        inclusion, inclusion_slope = self.inclusion_field.values_and_gradient(at)
        if direction_rad is not None:
            values, slopes = self.turned_field.values_and_gradient(at)
            inclusion += turned(values, direction_rad)
            inclusion_slope += turned(slopes, direction_rad)
        baseline, baseline_slope = self.baseline.values_and_gradient(at)
        factor = inclusion_factor(parameters)
        inclusion_slope = factor * self._by_normalised(inclusion_slope, parameters)
        inclusion_slope += _factor_slope(parameters) * inclusion
        slope = assemble(inclusion_slope, self._by_normalised(baseline_slope, parameters))
        return assemble(factor * inclusion, baseline), slope.transpose(1, 2, 0)

    def coordinates(self, normalised: Array, parameters: Array) -> Array:
        """Return the polynomials' coordinates [n, 9]: the offset runs from -1 to 1 over this surrogate's own range."""
        return offsets_in_range(polynomial_coordinates(normalised, parameters), self.from_mm, self.to_mm)

    def _by_normalised(self, gradient: Array, parameters: Array) -> Array:
        """Return derivatives [9, n, Q] by `normalised` of those by the polynomials' coordinates, at [n, 9]."""
        slope = _by_normalised(gradient, parameters)
        slope[OFFSET] *= float(HIGH[OFFSET] - LOW[OFFSET]) / (self.to_mm - self.from_mm)
        return slope

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the polynomials by the names in `ARRAYS`, as a file holds them: single precision."""
        values = (
            self.inclusion_field.degrees,
            self.inclusion_field.coefficients,
            self.turned_field.degrees,
            self.turned_field.coefficients,
            self.baseline.degrees,
            self.baseline.coefficients,
        )
        kinds = (np.uint8, np.float32) * 3
        return {name: np.asarray(value, kind) for name, value, kind in zip(ARRAYS, values, kinds, strict=True)}


class PressRows(Protocol):
    """A forward model of a press at any offset up to `to_mm`, in coordinates of `parameters.normalise`.

    Polynomials have the precision of their coordinates. Single is twice as fast and good to a millionth of the light,
    far below noise: a posterior's samples need no more.
    Directions [n] are those in which the inclusion lies in the image; without them rows are the mean over all of them.
    """

    @property
    def to_mm(self) -> float:
        """Largest offset."""
        ...

    def rows(self, normalised: Array, direction_rad: Array | None = None) -> Array:
        """Return profile rows [n, P] at coordinates [n, 9]; those of the offset go on beyond 1."""
        ...

    def rows_and_jacobian(self, normalised: Array, direction_rad: Array | None = None) -> tuple[Array, Array]:
        """Return the rows [n, P] at coordinates [n, 9] and their derivatives [n, P, 9] by them."""
        ...


@dataclass(frozen=True, eq=False)
class ScanSurrogate:
    """Two surrogates, of presses near the inclusion and beside it; `near` ends where `beside` begins."""

    near: PressSurrogate
    beside: PressSurrogate

    @property
    def to_mm(self) -> float:
        """Largest offset."""
        return self.beside.to_mm

    def rows(self, normalised: Array, direction_rad: Array | None = None) -> Array:
        """Return profile rows [n, P] at coordinates [n, 9], each of the surrogate that holds its offset."""
        is_beside = self._is_beside(normalised)
        rows = np.empty((len(normalised), COLUMNS), normalised.dtype)
        for surrogate, chosen in ((self.near, ~is_beside), (self.beside, is_beside)):
            if chosen.any():
                rows[chosen] = surrogate.rows(normalised[chosen], _of(direction_rad, chosen))
        return rows

    def rows_and_jacobian(self, normalised: Array, direction_rad: Array | None = None) -> tuple[Array, Array]:
        """Return the rows [n, P] at coordinates [n, 9] and their derivatives [n, P, 9] by them."""
        is_beside = self._is_beside(normalised)
        rows = np.empty((len(normalised), COLUMNS))
        jacobian = np.empty((len(normalised), COLUMNS, len(PARAMETERS)))
        for surrogate, chosen in ((self.near, ~is_beside), (self.beside, is_beside)):
            if chosen.any():
                directions = _of(direction_rad, chosen)
                rows[chosen], jacobian[chosen] = surrogate.rows_and_jacobian(normalised[chosen], directions)
        return rows, jacobian

    def _is_beside(self, normalised: Array) -> NDArray[np.bool_]:
        return np.asarray(denormalise(normalised)[:, OFFSET] > self.near.to_mm)


def surrogate_of(
    arrays: Mapping[str, NDArray[Any]], from_mm: float = float(LOW[OFFSET]), to_mm: float = float(HIGH[OFFSET])
) -> PressSurrogate:
    """Return the surrogate of the arrays in `ARRAYS`, for offsets `from_mm` to `to_mm`.

    Raises `InvalidQuantity` when an array is of another shape.
    """
    pairs = zip(ARRAYS[::2], ARRAYS[1::2], strict=True)
    fields = [LegendreSum(arrays[degrees], arrays[values].astype(np.float64)) for degrees, values in pairs]
    columns_of = INCLUSION_COLUMNS, len(WAVES) * INCLUSION_COLUMNS, RESPONSE_COLUMNS
    for field, columns in zip(fields, columns_of, strict=True):
        expected = (len(field.degrees), columns), (len(field.coefficients), len(PARAMETERS))
        if (field.coefficients.shape, field.degrees.shape) != expected:
            action = "install the model bundle again"
            raise InvalidQuantity("surrogate's shape", field.coefficients.shape, str(expected[0]), action)
    inclusion, turned_field, baseline = fields
    return PressSurrogate(inclusion, turned_field, baseline, from_mm, to_mm)


def turned(waves: Array, direction_rad: Array) -> Array:
    """Return what directions [n] add [..., n, Q], of what each wave of the direction does [..., n, waves x Q].

    A direction that is no number adds nothing.
    """
    each = waves.reshape(*waves.shape[:-1], len(WAVES), -1)
    return np.asarray(np.einsum("...nwq,nw->...nq", each, direction_waves(direction_rad)))


def direction_waves(direction_rad: Array) -> Array:
    """Return cos(2 phi) and cos(4 phi) [n, waves] of directions [n]; 0 for one that is no number."""
    return np.asarray(np.nan_to_num(np.cos(direction_rad[:, None] * WAVES)))


def _of(direction_rad: Array | None, chosen: NDArray[np.bool_]) -> Array | None:
    return None if direction_rad is None else direction_rad[chosen]


def far_field_strength(size_mm: Number, depth_mm: Number) -> Number:
    """Return size^3 / distance^3 of an inclusion's middle: how strong a small sphere's field is far away."""
    return (size_mm / (depth_mm + size_mm / 2)) ** 3


def polynomial_coordinates(normalised: Array, parameters: Array) -> Array:
    """Return coordinates [n, 9] in which presses are polynomials: the modulus' one is the elastic mismatch."""
    low, high = ELASTIC_MISMATCHES
    at = np.array(normalised)
    at[:, MODULUS] = 2 * (elastic_mismatch(parameters[:, MODULUS], parameters[:, TISSUE]) - low) / (high - low) - 1
    return at


def offsets_in_range(at: Array, from_mm: float, to_mm: float) -> Array:
    """Return coordinates [n, 9] whose offset, that of `normalise`, runs from -1 to 1 between two ends instead."""
    low, high = float(LOW[OFFSET]), float(HIGH[OFFSET])
    offset_mm = low + (at[:, OFFSET] + 1) / 2 * (high - low)
    moved = np.array(at)
    moved[:, OFFSET] = 2 * (offset_mm - from_mm) / (to_mm - from_mm) - 1
    return moved


def inclusion_factor(parameters: Array) -> Array:
    """Return what multiplies the polynomials [n, contrast and harmonics].

    The strength, and for the k-th harmonic the offset to the k-th power: so a smooth field's begins.
    """
    strength, place = _strength(parameters), parameters[:, OFFSET] / HIGH[OFFSET]
    return np.hstack([
        np.repeat((strength * place**order)[:, None], columns, axis=1) for order, columns in enumerate(HARMONICS)
    ])  # fmt: skip


def assemble(inclusion: Array, baseline: Array) -> Array:
    """Return rows [..., P] in the order of the row: contrast, reference response, harmonics."""
    return np.concatenate([inclusion[..., :CONTRAST_COLUMNS], baseline, inclusion[..., CONTRAST_COLUMNS:]], axis=-1)


def _strength(parameters: Array) -> Array:
    return np.asarray(far_field_strength(parameters[:, SIZE], parameters[:, DEPTH]))


def _factor_slope(parameters: Array) -> Array:
    """Return the derivatives [9, n, contrast and harmonics] of `inclusion_factor` by the coordinates."""
    size, depth, place = parameters[:, SIZE], parameters[:, DEPTH], parameters[:, OFFSET] / HIGH[OFFSET]
    by_normalised, strength, centre = slope_of_normalised(parameters), _strength(parameters), depth + size / 2
    by_size = strength * (3 / size - 1.5 / centre) * by_normalised[:, SIZE]
    by_depth = strength * (-3 / centre) * by_normalised[:, DEPTH]
    by_place = strength / HIGH[OFFSET] * by_normalised[:, OFFSET]
    slope = np.zeros((len(PARAMETERS), len(parameters), INCLUSION_COLUMNS))
    first = 0
    for order, count in enumerate(HARMONICS):
        columns = slice(first, first + count)
        slope[SIZE, :, columns] = (by_size * place**order)[:, None]
        slope[DEPTH, :, columns] = (by_depth * place**order)[:, None]
        if order:
            slope[OFFSET, :, columns] = (by_place * order * place ** (order - 1))[:, None]
        first += count
    return slope


def _by_normalised(gradient: Array, parameters: Array) -> Array:
    """Return derivatives [9, n, Q] by `normalised` of those by the polynomials' coordinates, at parameters [n, 9]."""
    (low, high), by_normalised = ELASTIC_MISMATCHES, slope_of_normalised(parameters)
    E, Et = parameters[:, MODULUS], parameters[:, TISSUE]
    by_mismatch = gradient[MODULUS] * (2 / (high - low) * 2.5 / (E + 1.5 * Et) ** 2)[:, None]
    slope = np.array(gradient)
    slope[MODULUS] = by_mismatch * (Et * by_normalised[:, MODULUS])[:, None]
    slope[TISSUE] -= by_mismatch * (E * by_normalised[:, TISSUE])[:, None]
    return slope
