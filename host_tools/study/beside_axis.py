"""How well the modulus of a lump beside the probe's axis can be known: bounds by the probe's own model and noise.

Beside the axis one side of the face is brighter. That first harmonic falls off with the radius as the contrast's slope
does, but its smooth errors are not those of the ring means: a second look, which may tell more than the unknown place
costs.
Source: the bound is that of `information`; rows and noise are what mode standard believes in (`models/standard`).
"""

from __future__ import annotations

import numpy as np

from device.measurement.press_surrogate import MODULUS
from device.measurement.profile_model import ProfileAnswers
from device.measurement.quantities import Inclusion
from host_tools.inverse.information import Array
from host_tools.inverse.press_bound import least_errors
from host_tools.study.accuracy_map import MODULI_KPA, Triple, lumps

OFFSETS_MM = (0.5, 1.0, 1.5, 2.0)


def spread_of_modulus(answers: ProfileAnswers, lump: Triple, offset_mm: float) -> float:
    """Return the bound of the modulus's coordinate, from -1 to 1 over its range, in mode standard.

    Tissue and skin are nominal; they, the place and the lump are known to lie in their ranges, each a Gaussian.
    """
    return float(least_errors(answers, "standard", Inclusion(*lump), {"offset_mm": offset_mm})[MODULUS])


def beside_over_axis(answers: ProfileAnswers) -> Array:
    """Return bounds of the modulus over those on the axis, [offsets, pairs of size and depth, moduli] of the map."""
    found = [[spread_of_modulus(answers, lump, offset_mm) for lump in lumps()] for offset_mm in (0.0, *OFFSETS_MM)]
    spreads = np.array(found).reshape(len(found), -1, len(MODULI_KPA))
    return np.asarray(spreads[1:] / spreads[0])
