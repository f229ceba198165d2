"""The least errors of size, depth and modulus: of one press of known truth, and of inclusions beside the axis.

The bound is Cramer and Rao's, for one ramp: of mode standard. Forward model and noise are those that its own bundle
believes in, linear about the truth; what is not known of tissue, skin and place is estimated too. The box counts as
Gaussian prior, in all coordinates, as it does in the mode's fits: an estimate that knows where the box ends may err a
little less. Source: Kay (1993), as `information`.

Beside the axis one side of the face is brighter. That first harmonic falls off with the radius as the contrast's slope
does, but its smooth errors are not those of the ring means: a second look, which may tell more than the unknown place
costs.
Source: the bound is that of `information`; rows and noise are what mode standard believes in (`models/standard`).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.parameters import COUNT, EVEN_STD, HIGH, LOW, NOMINAL, PARAMETERS, is_possible, normalise
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.surrogate import MODULUS
from host_tools.cramer_rao.accuracy_map import MODULI_KPA, Triple, inclusions
from host_tools.cramer_rao.information import cramer_rao

BOX_STD: Array = np.full(len(PARAMETERS), EVEN_STD)
OFFSETS_MM = (0.5, 1.0, 1.5, 2.0)


def least_errors(answers: RampAnswers, mode: Mode, truth: Inclusion, nuisances: Mapping[str, float] = NOMINAL) -> Array:
    """Return the least standard deviations [3] in coordinates, which run from -1 to 1 (`parameters.normalise`).

    nuisances: the true ones by their names in `PARAMETERS`; one that is not given is taken to be nominal. nan for a
    press outside the trained ranges, where the forward model says nothing, and for modes that are not of one ramp.
    """
    at = {**NOMINAL, **nuisances, **vars(truth)}
    parameters = np.array([at[name] for name in PARAMETERS])
    is_inside = np.all((parameters >= LOW) & (parameters <= HIGH)) and is_possible(parameters)
    if mode != "standard" or not is_inside:
        return np.full(COUNT, np.nan)
    (row,), (jacobian,) = answers.surrogate.rows_and_jacobian(normalise(parameters)[None])
    return cramer_rao(jacobian, answers.noise.covariance(row), BOX_STD).std[:COUNT]


def spread_of_modulus(answers: RampAnswers, inclusion: Triple, offset_mm: float) -> float:
    """Return the bound of the modulus's coordinate, from -1 to 1 over its range, in mode standard.

    Tissue and skin are nominal; they, the place and the inclusion are known to lie in their ranges, each a Gaussian.
    """
    return float(least_errors(answers, "standard", Inclusion(*inclusion), {"offset_mm": offset_mm})[MODULUS])


def beside_over_axis(answers: RampAnswers) -> Array:
    """Return bounds of the modulus over those on the axis, [offsets, pairs of size and depth, moduli] of the map."""
    found = [
        [spread_of_modulus(answers, inclusion, offset_mm) for inclusion in inclusions()]
        for offset_mm in (0.0, *OFFSETS_MM)
    ]
    spreads = np.array(found).reshape(len(found), -1, len(MODULI_KPA))
    return np.asarray(spreads[1:] / spreads[0])
