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
from host_tools.forward.ladder import ToleranceMissed, climb
from host_tools.forward.plan import model_plan
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve_ramp
from host_tools.scenes.scene import Press, Scene

Truth = NDArray[np.float64]
NOT_COLUMNS = ("plan", "pressure_is_positive", "contact_force_n")
"""Entries of a solution's record that are the same in every row, told as its level, or a check that it has passed."""


def solve_row(plan: SweepPlan, index: int, truth: Truth) -> Row:
    """Solve one scene under the plan's loads; a scene that fails under any of them becomes a row with its reason."""
    try:
        solutions = _solve_loads(plan, plan.scene(truth))
    except (PressFailed, InvalidQuantity) as refused:
        return empty_row(index, truth, reason=str(refused))
    except (NgException, ValueError, ArithmeticError, RuntimeError) as error:
        return empty_row(index, truth, reason=f"{type(error).__name__}: {error}")
    columns = [_columns(solution) for solution in solutions]
    if plan.has_load_axis:
        of_loads = {name: [column[name] for column in columns] for name in columns[0]}
        told = {} if plan.tolerance is None else {"level": solutions[-1].plan.level}
        return empty_row(index, truth) | told | of_loads | {"r_mm": columns[0]["r_mm"]}
    return empty_row(index, truth) | columns[0]


def empty_row(index: int, truth: Truth, *, reason: str = "") -> Row:
    """Return what is known of a scene without a solution; `reason` says why there is none."""
    return {"index": index, **dict(zip(UNKNOWNS, map(float, truth), strict=True)), "reason": reason}


def _solve_loads(plan: SweepPlan, scene: Scene) -> tuple[Solution, ...]:
    """Return one solution per force, with its stated errors, from one solve of the whole ramp.

    Without a tolerance on the level that all scenes share.
    """
    presses = [Press(force_n=force_n) for force_n in plan.forces_n]
    if plan.tolerance is not None:
        climbed = climb(
            scene, presses, tolerance=plan.tolerance, strain=plan.strain, within_s=plan.within_s, best=False
        )
        if climbed.missed:
            raise ToleranceMissed(climbed.missed, climbed)
        return climbed.solutions
    assert plan.strain != "auto"  # a plan without a tolerance refuses it
    return solve_ramp(scene, presses, model_plan(scene, strain=plan.strain), estimate_error=True)


def _columns(solution: Solution) -> Row:
    """Return the solution's record flat: an entry `max_deformation_mm` of `raw` is `raw_max_deformation_mm`."""
    columns: Row = {}
    for name, value in solution.as_record().items():
        if name in NOT_COLUMNS:
            continue
        columns |= {f"{name}_{part}": v for part, v in value.items()} if isinstance(value, dict) else {name: value}
    return columns
