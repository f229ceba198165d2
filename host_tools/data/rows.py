"""One scene of a sweep to one row: truth, what was solved under every load, and the reason if it was not solved.

A scene that cannot be meshed or solved is a row too. This runs in the worker; a row is plain JSON, so it can travel.
"""

from __future__ import annotations

import numpy as np
from netgen.meshing import NgException
from numpy.typing import NDArray

from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from host_tools.data.journal import Row
from host_tools.data.plan import SweepPlan
from host_tools.forward.ladder import worst_error
from host_tools.forward.model_departures import largest_departure
from host_tools.forward.plan import StrainModel, model_plan
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve_ramp
from host_tools.scenes.scene import Press, Scene

Truth = NDArray[np.float64]
NOT_COLUMNS = ("plan", "pressure_is_positive", "contact_force_n")
"""Entries of a solution's record that are the same in every row, or a check that the row has passed."""


def solve_row(plan: SweepPlan, index: int, truth: Truth) -> Row:
    """Solve one scene under the plan's loads; a scene that fails under any of them becomes a row with its reason."""
    try:
        solutions = _solve_loads(plan.scene(truth), plan.forces_n, plan.strain)
    except (PressFailed, InvalidQuantity) as refused:
        return empty_row(index, truth, reason=str(refused))
    except (NgException, ValueError, ArithmeticError, RuntimeError) as error:
        return empty_row(index, truth, reason=f"{type(error).__name__}: {error}")
    if reason := _missed(solutions, plan.tolerance):
        return empty_row(index, truth, reason=reason)
    columns = [_columns(solution) for solution in solutions]
    if plan.has_load_axis:
        of_loads = {name: [column[name] for column in columns] for name in columns[0]}
        return empty_row(index, truth) | of_loads | {"r_mm": columns[0]["r_mm"]}
    return empty_row(index, truth) | columns[0]


def _missed(solutions: tuple[Solution, ...], tolerance: float | None) -> str:
    """Return what is worse than the tolerance: nothing when nothing is, or none was asked.

    Which feature of which load states more; or what small strain departs from finite strain by at the largest load.
    """
    feature, error, force_n = max(((*worst_error(one), one.force_n) for one in solutions), key=lambda worst: worst[1])
    if tolerance is None:
        return ""
    asked = f"but {100 * tolerance:g} % was asked for"
    if error > tolerance:
        return f"{feature} under {force_n:g} N is only good to {100 * error:.2g} %, {asked}"
    largest = solutions[-1]
    departure = largest_departure(largest.scene) if largest.plan.strain == "small" else 0.0
    if error + departure <= tolerance:
        return ""
    departs = f"small strain may depart from finite strain by {100 * departure:.2g} % under {largest.force_n:g} N"
    return f"{departs}, {asked}: press less, or sweep in finite strain (--strain finite)"


def empty_row(index: int, truth: Truth, *, reason: str = "") -> Row:
    """Return what is known of a scene without a solution; `reason` says why there is none."""
    return {"index": index, **dict(zip(UNKNOWNS, map(float, truth), strict=True)), "reason": reason}


def _solve_loads(scene: Scene, forces_n: tuple[float, ...], strain: StrainModel) -> tuple[Solution, ...]:
    """Return one solution per force, with its stated errors, from one solve of the whole ramp."""
    presses = [Press(force_n=force_n) for force_n in forces_n]
    return solve_ramp(scene, presses, model_plan(scene, strain=strain), estimate_error=True)


def _columns(solution: Solution) -> Row:
    """Return the solution's record flat: an entry `max_deformation_mm` of `raw` is `raw_max_deformation_mm`."""
    columns: Row = {}
    for name, value in solution.as_record().items():
        if name in NOT_COLUMNS:
            continue
        columns |= {f"{name}_{part}": v for part, v in value.items()} if isinstance(value, dict) else {name: value}
    return columns
