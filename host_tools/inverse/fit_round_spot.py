"""Random presses to the second harmonics of round lumps: polynomials as those of the surrogate, by least squares.

The offset is the reason of a second harmonic and enters by its square; the rest bends it little. What counts is the
error on presses kept apart, against the 1e-3 that flat field and model leave open.
"""

from __future__ import annotations

import numpy as np

from device.measurement.legendre import LegendreSum, terms
from device.measurement.press_parameters import to_unit
from device.measurement.press_surrogate import polynomial_coordinates
from device.measurement.quantities import Bound, require
from device.measurement.round_spot import RoundSpot, second_factor
from host_tools.inverse.fit_surrogate import PRESSES_A_TERM, degrees
from host_tools.inverse.press_samples import Array, PressSamples

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
"""A term counts when its degrees over these add up to at most 1."""
SECOND_HIGHEST = {"size_mm": 7, "depth_mm": 6}


def fit_second_harmonics(samples: PressSamples) -> LegendreSum:
    """Return polynomials [9] to [Q] of `RoundSpot`; raises `InvalidQuantity` when the presses are too few."""
    found = degrees(SECOND_REACH, SECOND_HIGHEST)
    bound = Bound(PRESSES_A_TERM * len(found), np.inf, "presses")
    require("presses", len(samples.rows), bound, "simulate more presses")
    at = polynomial_coordinates(to_unit(samples.parameters), samples.parameters)
    design = second_factor(samples.parameters)[:, None] * terms(found, at)
    coefficients, *_ = np.linalg.lstsq(design, samples.second_harmonics, rcond=None)
    return LegendreSum(found, np.asarray(coefficients))


def held_out_second_harmonics(round_spot: RoundSpot, samples: PressSamples) -> Array:
    """Return the root mean square error [Q] of second harmonics on presses that were kept apart."""
    errors = round_spot.second_harmonics(to_unit(samples.parameters)) - samples.second_harmonics
    return np.asarray(np.sqrt(np.mean(errors**2, axis=0)))
