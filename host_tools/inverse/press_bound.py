"""A press of known truth to the least errors of size, depth and modulus: the Cramer-Rao bound of its very mode.

Forward model and noise are those that the mode's own bundle believes in, linear about the truth; what is not known of
tissue, skin and place is estimated too. The box counts as Gaussian prior, in all coordinates, as it does in the fits
of mode precise: an estimate that knows where the box ends may err a little less. Source: Kay (1993), as `information`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from device.measurement.mode import Mode
from device.measurement.press_parameters import COUNT, EVEN_STD, HIGH, LOW, NOMINAL, PARAMETERS, to_unit
from device.measurement.profile_model import ProfileAnswers
from device.measurement.quantities import Inclusion
from host_tools.inverse.information import Array, cramer_rao

BOX_STD: Array = np.full(len(PARAMETERS), EVEN_STD)


def least_errors(
    answers: ProfileAnswers, mode: Mode, truth: Inclusion, nuisances: Mapping[str, float] = NOMINAL
) -> Array:
    """Return the least standard deviations [3] in coordinates, which run from -1 to 1 (`press_parameters.to_unit`).

    nuisances: the true ones by their names in `PARAMETERS`; one that is not given is taken to be nominal. nan for a
    press outside the trained ranges, where the forward model says nothing, and for a mode whose bundle has no noise.
    """
    at = {**NOMINAL, **nuisances, **vars(truth)}
    parameters = np.array([at[name] for name in PARAMETERS])
    if mode not in answers.noise or not np.all((parameters >= LOW) & (parameters <= HIGH)):
        return np.full(COUNT, np.nan)
    row, jacobian = answers.surrogate.rows_and_jacobian(to_unit(parameters))
    return cramer_rao(jacobian, answers.noise[mode].covariance(row), BOX_STD).std[:COUNT]
