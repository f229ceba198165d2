"""Two orders of a press, element by element, to the error that the higher one states of its force and of O1-O3.

Stated is the sum over the elements of the absolute dual-weighted residual, the step from the lower order, had no
element's error cancelled another's, times factors of the order and of whether a rim is near. The baseline is subtracted
before the absolute value, since on one mesh its error is the lesion's own and cancels. At a prescribed force each sum
also moves by what the indentation errs. Measured: `host_tools verify --effectivity`.
"""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from host_tools.forward.deformation import deformation
from host_tools.forward.error_estimates.feature_slopes import Slope, feature_slopes
from host_tools.forward.error_estimates.stated_error import CANCELLING_UNDER_FORCE
from host_tools.forward.face_state import Rays
from host_tools.forward.press_model import Loaded

NEAR_RIM = {3: 0.5, 4: 1.25, 5: 1.25, 6: 1.25}
"""Stated over the sum of elements near a rim, by order."""
ELSEWHERE = {3: 0.083, 4: 0.25}
"""The same of all others at low orders: from order 3 to 4 a fortieth of what they owe is left, near a rim a ninth."""
BEYOND = 2.0
"""Above order 6, where the layers around the rims are used up and errors fall less from order to order."""
CANCELLING_FACTOR = 2.5
"""The total under a force states so much more: what the force errs is left of it when centre and border cancel."""
ROUNDING_RATIO = 1e-13
"""What rounding leaves of a displacement: it shows in inclusions that move the face by less than a billionth."""


def dual_error(rays: Rays, pressed: Loaded, baseline: Loaded, *, order: int, by_force: bool) -> dict[str, float]:
    """Return the stated relative error of an order by feature; of force and indentation the prescribed one has none."""
    assert pressed.residual is not None
    factors = _factors(order, pressed.residual.is_near_rim)
    stiff = _size(factors, pressed.residual.force_n) * pressed.state.indentation_mm / pressed.state.force_n
    added_mm = pressed.state.w_mm - baseline.state.w_mm
    values = asdict(deformation(rays.r_mm, added_mm, pressed.state.total_mm3 - baseline.state.total_mm3))
    rounding = ROUNDING_RATIO * np.abs(pressed.state.w_mm).max() / max(np.abs(added_mm).max(), 1e-300)
    stated = {"force_n": 0.0 if by_force else stiff, "indentation_mm": stiff if by_force else 0.0}
    for name, slope in feature_slopes(rays.r_mm[0], added_mm[0]).items():
        owed = _owed(pressed, slope, by_force=by_force) - _owed(baseline, slope, by_force=by_force)
        stated[name] = _size(factors, owed) / abs(values[name]) + rounding if values[name] else 0.0
    if by_force:
        stated[CANCELLING_UNDER_FORCE] *= CANCELLING_FACTOR
    return stated


def _owed(loaded: Loaded, slope: Slope, *, by_force: bool) -> Array:
    """Return what each element [elements] owes to a sum over the deformation of one material's face."""
    state, residual = loaded.state, loaded.residual
    assert residual is not None
    owed = state.indentation_mm * residual.of(*slope)
    if by_force:
        value = float(slope.per_sample @ state.w_mm[0]) + slope.per_total * state.total_mm3
        owed = owed + value * residual.force_n * state.indentation_mm / state.force_n
    return owed


def _factors(order: int, is_near_rim: NDArray[np.bool_]) -> Array:
    """Return stated over owed of each element [elements]."""
    near = NEAR_RIM.get(order, BEYOND)
    return np.where(is_near_rim, near, ELSEWHERE.get(order, near))


def _size(factors: Array, parts: Array) -> float:
    return float(factors @ np.abs(parts))
