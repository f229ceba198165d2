"""Whether a bright spot is round: its second harmonic, against that of the best fit's round inclusion.

A round inclusion beside the axis shows a second harmonic, too; polynomials tell it, as the surrogate's tell the
profile. What is left is searched for a spot that is stretched in some direction: the contrast f(r) becomes f(r) + e r
df/dr cos(2 (angle - a)), whose second harmonic is r df/dr times e. How far e lies from 0, in standard deviations of all
that camera, flat field and model leave open, is about Rayleigh's for a round inclusion; what the best fit itself does
not know adds a little, so the critical value is measured on recordings. Source: Kay, Fundamentals of Statistical Signal
Processing II (1998), 13.4.3, a known pattern of unknown amplitude and phase; docs/modes.md counts how often inclusions
that are not round, and pairs of inclusions, are refused.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.parameters import HIGH, PARAMETERS, denormalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.noise import LOADS, ErrorLevels, smooth_second_harmonics
from device.measurement.ramp_modes.surrogate import (
    CONTRAST_COLUMNS,
    DEPTH,
    OFFSET,
    SIZE,
    PressSurrogate,
    far_field_strength,
    polynomial_coordinates,
)
from device.measurement.recording.ring_means import RING_RADII_MM, RINGS

ROUND_FILE = "round.npz"
SECOND_COLUMNS = LOADS * (RINGS - 2)
"""Second harmonics of all loads and rings, without the one in the middle, which has none, and the outermost one."""
DEGREES, COEFFICIENTS = "second_degrees", "second_coefficients"


@dataclass(frozen=True, eq=False)
class EllipticityTest:
    """Second harmonics of round inclusions, and how far noise takes them.

    `second`: polynomials [9] to [Q] of the second harmonic over `second_factor`; `camera`: of each mode the covariance
    [Q, Q] of repeated recordings over the light ratio, of what lies along as of what lies across.
    """

    surrogate: PressSurrogate
    second: LegendreSum
    camera: Mapping[Mode, Array]
    levels: ErrorLevels = field(default_factory=ErrorLevels)

    def second_harmonics(self, normalised: Array) -> Array:
        """Return the second harmonics [n, Q] of round inclusions along their offset, at coordinates [n, 9]."""
        parameters = denormalise(normalised)
        return second_factor(parameters)[:, None] * self.second.values(polynomial_coordinates(normalised, parameters))

    def elongation_deviations(self, second_harmonic: Array, best: Array, mode: Mode) -> float:
        """Return how far a press' `second_harmonic` [2, K, J - 2] is from round, in standard deviations.

        `best` are the coordinates [9] of its best fit.
        """
        pattern = stretched(self._contrast(best))
        weights = np.linalg.solve(self.covariance(best, mode), pattern)
        return float(np.linalg.norm(self.left(second_harmonic, best) @ weights) / np.sqrt(weights @ pattern))

    def left(self, second_harmonic: Array, best: Array) -> Array:
        """Return what a round inclusion leaves [2, Q], along and across its offset, of harmonics [2, K, J - 2]."""
        left = second_harmonic.reshape(2, SECOND_COLUMNS).copy()
        left[0] -= self.second_harmonics(best[None])[0]
        return left

    def covariance(self, best: Array, mode: Mode) -> Array:
        """Return the covariance [Q, Q] of what noise leaves, along as across."""
        light = 1 + self._contrast(best)[:, 1:-1].ravel()
        return np.asarray(light[:, None] * light * (self.camera[mode] + smooth_second_harmonics(self.levels)))

    def _contrast(self, normalised: Array) -> Array:
        return self.surrogate.rows(normalised[None])[0, :CONTRAST_COLUMNS].reshape(LOADS, RINGS)


def second_factor(parameters: Array) -> Array:
    """Return what multiplies the polynomials [n]: the far field's strength, and the square of the offset's place."""
    strength = far_field_strength(parameters[:, SIZE], parameters[:, DEPTH])
    return np.asarray(strength * (parameters[:, OFFSET] / HIGH[OFFSET]) ** 2)


def stretched(contrast: Array) -> Array:
    """Return the second harmonics [Q] of spots of contrast [K, J] that are stretched, for a stretch of 1: r df/dr."""
    slope_per_mm = np.gradient(contrast, RING_RADII_MM, axis=1)
    return np.asarray((RING_RADII_MM * slope_per_mm)[:, 1:-1].ravel())


def ellipticity_arrays(modes: tuple[Mode, ...]) -> tuple[str, ...]:
    """Return the names of the arrays in the file of a bundle."""
    return DEGREES, COEFFICIENTS, *(f"camera_{mode}" for mode in modes)


def ellipticity_test_of(
    arrays: Mapping[str, NDArray[Any]], surrogate: PressSurrogate, modes: tuple[Mode, ...]
) -> EllipticityTest:
    """Return what the arrays of `ellipticity_arrays` say; raise `InvalidQuantity` when one is of another shape."""
    degrees, coefficients, *cameras = (arrays[name] for name in ellipticity_arrays(modes))
    shapes = [one.shape for one in (degrees, coefficients, *cameras)]
    square = (SECOND_COLUMNS, SECOND_COLUMNS)
    expected = [(len(degrees), len(PARAMETERS)), (len(degrees), SECOND_COLUMNS), *[square] * len(modes)]
    if shapes != expected:
        action = "install the model bundle again"
        raise InvalidQuantity("shapes of the second harmonics", shapes, str(expected), action)
    second = LegendreSum(degrees, coefficients.astype(np.float64))
    camera = dict(zip(modes, (one.astype(np.float64) for one in cameras), strict=True))
    return EllipticityTest(surrogate, second, camera)
