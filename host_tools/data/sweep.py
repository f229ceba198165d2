"""Random scenes of the paper's box to a data set, on all cores, resumable, failures kept as rows with their reason.

Every scene is pressed with the same *force*, since that is what the probe can hold: at equal force the lump field is
two thirds of what it is at equal indentation. Source of the box: Lee & Won 2013, section III.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from netgen.meshing import NgException
from numpy.typing import NDArray

from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, InvalidQuantity, require
from host_tools.data.dataset import write_dataset
from host_tools.data.journal import Journal, Row
from host_tools.forward.solve import solve
from host_tools.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Press, Scene

DEFAULT_FORCE_N = 0.5


@dataclass(frozen=True)
class SweepPlan:
    """What is swept: `scenes` draws from the box with a seed, each pressed with `force_n`."""

    scenes: int
    seed: int
    force_n: float = DEFAULT_FORCE_N

    def __post_init__(self) -> None:
        require("scenes", self.scenes, Bound(1, 1_000_000, "scenes"), "ask for at least one scene")
        require("seed", self.seed, Bound(0, 2**63, ""), "give a whole number from 0")

    def truths(self) -> NDArray[np.float64]:
        """Return the drawn (size_mm, depth_mm, youngs_modulus_kpa) [scenes, 3]; prefix-stable."""
        return np.random.default_rng(self.seed).uniform(PAPER_BOX_LOW, PAPER_BOX_HIGH, (self.scenes, 3))

    def scene(self, truth: NDArray[np.float64]) -> Scene:
        """Return the scene of one draw."""
        return Scene(Inclusion(*map(float, truth)), Press(force_n=self.force_n))

    def as_record(self) -> Row:
        """Return what the journal and the data set say of their origin."""
        surroundings = Scene(None, Press(force_n=self.force_n)).surroundings()
        box = {"low": PAPER_BOX_LOW, "high": PAPER_BOX_HIGH}
        return {"schema": "tsis.sweep/1", **asdict(self), "box": box, "scene_defaults": surroundings}


def solve_row(plan: SweepPlan, index: int, truth: NDArray[np.float64]) -> Row:
    """Solve one scene; a scene that cannot be meshed or solved becomes a row with its reason."""
    row: dict[str, Any] = {"index": index, **dict(zip(UNKNOWNS, map(float, truth), strict=True)), "reason": ""}
    try:
        solution = solve(plan.scene(truth))
    except (NgException, ValueError, ArithmeticError, RuntimeError) as error:
        return row | {"reason": f"{type(error).__name__}: {error}"}
    if not solution.pressure_is_positive:
        return row | {"reason": f"the contact opens: pressure falls to {solution.p_kpa.min():.3g} kPa"}
    record = solution.as_record()
    del record["raw"], record["plan"], record["pressure_is_positive"], record["contact_force_n"]
    return row | record | {f"raw_{name}": value for name, value in asdict(solution.raw).items()}


def sweep(
    plan: SweepPlan, out: Path, *, jobs: int = -1, on_row: Callable[[Row, int], None] = lambda row, done: None
) -> Path:
    """Solve every scene that `out`'s journal does not hold yet, then write `out`; return it.

    `on_row` hears each new row and how many there are. Interrupted, it leaves the journal and no `out`.
    """
    if jobs == 0:
        raise InvalidQuantity("jobs", jobs, "a number of processes, or -1 for all cores", "leave the option away")
    out.parent.mkdir(parents=True, exist_ok=True)
    journal = Journal(out.with_suffix(out.suffix + ".partial"), plan.as_record())
    truths = plan.truths()
    try:
        missing = [i for i in range(plan.scenes) if i not in journal.rows]
        os.environ["OPENBLAS_NUM_THREADS"] = "1"  # inherited by the workers: one solve, one core
        solved = Parallel(n_jobs=jobs, return_as="generator_unordered")(
            delayed(solve_row)(plan, i, truths[i]) for i in missing
        )
        for row in solved:
            journal.append(row)
            on_row(row, len(journal.rows))
    finally:
        journal.close()
    write_dataset([journal.rows[i] for i in range(plan.scenes)], plan.as_record(), out)
    journal.remove()
    return out
