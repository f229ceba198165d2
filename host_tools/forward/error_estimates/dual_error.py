"""Two orders of a press, element by element, to the error that the higher one states of its force and of O1-O3.

Stated is the sum over the elements of the absolute dual-weighted residual, the step from the lower order, had no
element's error cancelled another's, times a factor of the order. The baseline is subtracted before the absolute value,
since on one mesh its error is the lesion's own and cancels. At a prescribed force each sum also moves by what the
indentation errs. Measured: `host_tools verify --effectivity`.
"""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from device.measurement.arrays import Array
from host_tools.forward.deformation import deformation
from host_tools.forward.error_estimates.feature_slopes import Slope, feature_slopes
from host_tools.forward.face_state import Rays
from host_tools.forward.press_model import Loaded

SAFETY_FACTOR = 2.0
FACTORS = {3: 0.2, 4: 0.6}
"""Stated over the sum at low orders, whose next step is a tenth of the last; beyond them it is `SAFETY_FACTOR`, for
there the rims decide, whose errors fall less from order to order."""
ROUNDING_RATIO = 1e-13
"""What rounding leaves of a displacement: it shows in inclusions that move the face by less than a billionth."""


def dual_error(rays: Rays, pressed: Loaded, baseline: Loaded, *, order: int, by_force: bool) -> dict[str, float]:
    """Return the stated relative error of an order by feature; of force and indentation the prescribed one has none."""
    assert pressed.residual is not None
    factor = FACTORS.get(order, SAFETY_FACTOR)
    stiff = factor * _size(pressed.residual.force_n) * pressed.state.indentation_mm / pressed.state.force_n
    added_mm = pressed.state.w_mm - baseline.state.w_mm
    values = asdict(deformation(rays.r_mm, added_mm, pressed.state.total_mm3 - baseline.state.total_mm3))
    rounding = ROUNDING_RATIO * np.abs(pressed.state.w_mm).max() / max(np.abs(added_mm).max(), 1e-300)
    stated = {"force_n": 0.0 if by_force else stiff, "indentation_mm": stiff if by_force else 0.0}
    for name, slope in feature_slopes(rays.r_mm[0], added_mm[0]).items():
        owed = _owed(pressed, slope, by_force=by_force) - _owed(baseline, slope, by_force=by_force)
        stated[name] = factor * _size(owed) / abs(values[name]) + rounding if values[name] else 0.0
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


def _size(parts: Array) -> float:
    return float(np.abs(parts).sum())
