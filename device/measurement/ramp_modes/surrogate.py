"""The forward model of a press in a millisecond: unknowns and nuisances to the row of the press profile.

Polynomials in nine parameters, fitted to simulated presses by `host_tools train`. What is polynomial is the contrast
over size^3 / distance^3, the strength of a small sphere far away, and the modulus enters by Eshelby's mismatch: both
take out what no polynomial follows well. Differentiable, so that a press can be fitted by Gauss-Newton.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import HIGH, LOW, PARAMETERS, denormalise, slope_of_normalised
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N
from device.measurement.recording.ring_means import RINGS

SIZE, DEPTH, MODULUS, TISSUE, OFFSET = (
    PARAMETERS.index(name) for name in ("size_mm", "depth_mm", "youngs_modulus_kpa", "tissue_modulus_kpa", "offset_mm")
)
CONTRAST_COLUMNS = len(PROFILE_FORCES_N) * RINGS
RESPONSE_COLUMNS = (len(PROFILE_FORCES_N) - 1) * RINGS
OFFSET_COLUMNS = RINGS - 1
Number = TypeVar("Number", float, Array)
ARRAYS = ("lump_degrees", "lump_coefficients", "bare_degrees", "bare_coefficients")


def elastic_mismatch(modulus_kpa: Array, tissue_kpa: Array) -> Array:
    """Return (E - Et) / (E + 3/2 Et), the dipole strength of an incompressible sphere (Eshelby 1957)."""
    return np.asarray((modulus_kpa - tissue_kpa) / (modulus_kpa + 1.5 * tissue_kpa))


ELASTIC_MISMATCH_RANGE = (
    float(elastic_mismatch(LOW[MODULUS], HIGH[TISSUE])),
    float(elastic_mismatch(HIGH[MODULUS], LOW[TISSUE])),
)


@dataclass(frozen=True, eq=False)
class PressSurrogate:
    """`inclusion_field`: contrast and offset over the strength. `baseline`: reference force response."""

    inclusion_field: LegendreSum
    baseline: LegendreSum

    def rows(self, normalised: Array) -> Array:
        """Return profile rows [n, P] at coordinates [n, 9] of `parameters.normalise`."""
        parameters = denormalise(normalised)
        at = polynomial_coordinates(normalised, parameters)
        factor = inclusion_factor(parameters)
        return assemble(factor * self.inclusion_field.values(at), self.baseline.values(at))

    def rows_and_jacobian(self, normalised: Array) -> tuple[Array, Array]:
        """Return the rows [n, P] at coordinates [n, 9] and their derivatives [n, P, 9] by them."""
        parameters = denormalise(normalised)
        at = polynomial_coordinates(normalised, parameters)
        inclusion, inclusion_slope = self.inclusion_field.values_and_gradient(at)
        baseline, baseline_slope = self.baseline.values_and_gradient(at)
        factor = inclusion_factor(parameters)
        inclusion_slope = factor * _by_normalised(inclusion_slope, parameters) + _factor_slope(parameters) * inclusion
        slope = assemble(inclusion_slope, _by_normalised(baseline_slope, parameters))
        return assemble(factor * inclusion, baseline), slope.transpose(1, 2, 0)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the polynomials by the names in `ARRAYS`, as a file holds them: single precision."""
        values = (
            self.inclusion_field.degrees,
            self.inclusion_field.coefficients,
            self.baseline.degrees,
            self.baseline.coefficients,
        )
        kinds = (np.uint8, np.float32, np.uint8, np.float32)
        return {name: np.asarray(value, kind) for name, value, kind in zip(ARRAYS, values, kinds, strict=True)}


def surrogate_of(arrays: Mapping[str, NDArray[Any]]) -> PressSurrogate:
    """Return the surrogate of the arrays in `ARRAYS`; raise `InvalidQuantity` when one is of another shape."""
    a, b, c, d = (arrays[name] for name in ARRAYS)
    inclusion, baseline = LegendreSum(a, b.astype(np.float64)), LegendreSum(c, d.astype(np.float64))
    for field, columns in ((inclusion, CONTRAST_COLUMNS + OFFSET_COLUMNS), (baseline, RESPONSE_COLUMNS)):
        expected = (len(field.degrees), columns), (len(field.coefficients), len(PARAMETERS))
        if (field.coefficients.shape, field.degrees.shape) != expected:
            action = "install the model bundle again"
            raise InvalidQuantity("surrogate's shape", field.coefficients.shape, str(expected[0]), action)
    return PressSurrogate(inclusion, baseline)


def far_field_strength(size_mm: Number, depth_mm: Number) -> Number:
    """Return size^3 / distance^3 of an inclusion's middle: how strong a small sphere's field is far away."""
    return (size_mm / (depth_mm + size_mm / 2)) ** 3


def polynomial_coordinates(normalised: Array, parameters: Array) -> Array:
    """Return coordinates [n, 9] in which presses are polynomials: the modulus' one is the elastic mismatch."""
    low, high = ELASTIC_MISMATCH_RANGE
    at = np.array(normalised)
    at[:, MODULUS] = 2 * (elastic_mismatch(parameters[:, MODULUS], parameters[:, TISSUE]) - low) / (high - low) - 1
    return at


def inclusion_factor(parameters: Array) -> Array:
    """Return what multiplies the polynomials [n, contrast + offset columns]: strength, and for the offset its place."""
    strength, offset = _strength(parameters), parameters[:, OFFSET] / HIGH[OFFSET]
    return np.hstack([
        np.repeat(strength[:, None], CONTRAST_COLUMNS, axis=1),
        np.repeat((strength * offset)[:, None], OFFSET_COLUMNS, axis=1),
    ])  # fmt: skip


def assemble(inclusion: Array, baseline: Array) -> Array:
    """Return rows [..., P] in the order of `radial_profile.ROW_NAMES`: contrast, reference response, offset."""
    return np.concatenate([inclusion[..., :CONTRAST_COLUMNS], baseline, inclusion[..., CONTRAST_COLUMNS:]], axis=-1)


def _strength(parameters: Array) -> Array:
    return np.asarray(far_field_strength(parameters[:, SIZE], parameters[:, DEPTH]))


def _factor_slope(parameters: Array) -> Array:
    """Return the derivatives [9, n, contrast + offset columns] of `inclusion_factor` by the coordinates."""
    size, depth, place = parameters[:, SIZE], parameters[:, DEPTH], parameters[:, OFFSET] / HIGH[OFFSET]
    slope = np.zeros((len(PARAMETERS), len(parameters), CONTRAST_COLUMNS + OFFSET_COLUMNS))
    by_normalised, strength, centre = slope_of_normalised(parameters), _strength(parameters), depth + size / 2
    by_size = strength * (3 / size - 1.5 / centre) * by_normalised[:, SIZE]
    by_depth = strength * (-3 / centre) * by_normalised[:, DEPTH]
    for parameter, by_parameter in ((SIZE, by_size), (DEPTH, by_depth)):
        slope[parameter, :, :CONTRAST_COLUMNS] = by_parameter[:, None]
        slope[parameter, :, CONTRAST_COLUMNS:] = (place * by_parameter)[:, None]
    slope[OFFSET, :, CONTRAST_COLUMNS:] = (strength / HIGH[OFFSET] * by_normalised[:, OFFSET])[:, None]
    return slope


def _by_normalised(gradient: Array, parameters: Array) -> Array:
    """Return derivatives [9, n, Q] by `normalised` of those by the polynomials' coordinates, at parameters [n, 9]."""
    (low, high), by_normalised = ELASTIC_MISMATCH_RANGE, slope_of_normalised(parameters)
    E, Et = parameters[:, MODULUS], parameters[:, TISSUE]
    by_mismatch = gradient[MODULUS] * (2 / (high - low) * 2.5 / (E + 1.5 * Et) ** 2)[:, None]
    slope = np.array(gradient)
    slope[MODULUS] = by_mismatch * (Et * by_normalised[:, MODULUS])[:, None]
    slope[TISSUE] -= by_mismatch * (E * by_normalised[:, TISSUE])[:, None]
    return slope
