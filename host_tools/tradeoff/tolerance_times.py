"""What a tolerance takes: the default inclusion climbed to one after another, in small and finite strain and in 3-D.

As `host_tools simulate` climbs, without the start of its process. Each answer has two points: what was asked for, and
what the answer states.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from device.measurement.quantities import Inclusion
from host_tools.forward.ladder import Climb, climb
from host_tools.forward.plan import DEFAULT_TOLERANCE
from host_tools.pages.benchmark import Benchmark, Chapter, at_most
from host_tools.scenes.scene import AskedStrain, Placement, Scene
from host_tools.tradeoff.fronts import Panel, front_figure, front_table
from host_tools.tradeoff.pareto import Choice
from host_tools.tradeoff.yardstick import cost

INCLUSION = Inclusion(10.0, 6.0, 80.0)
ASKED, STATED = "asked for", "stated"
WITHIN_S = 600.0
"""Generous: processor time is counted, on a machine that others use."""


class Climbed(NamedTuple):
    """A sort of model, its scene and strain, and the tolerances that it is asked for."""

    title: str
    scene: Scene
    strain: AskedStrain
    tolerances: tuple[float, ...]


CLIMBS = (
    Climbed("small strain", Scene(INCLUSION), "small", (0.05, 0.01, 0.005, 0.002, 5e-4, 2e-4)),
    Climbed("finite strain", Scene(INCLUSION), "finite", (0.2, 0.05, 0.02, 0.005, 0.002)),
    Climbed("6 mm off the axis", Scene(INCLUSION, placement=Placement(offset_x_mm=6.0)), "small", (0.3, 0.02, 0.01)),
)
SHORT = (CLIMBS[0]._replace(tolerances=(0.05, 0.002)),)
"""One sort, two tolerances: to try the chain."""


def measured(asked: Climbed, repeats: int) -> tuple[Panel, list[Benchmark]]:
    """Return two points a tolerance, and whether what is stated is within it."""
    points, judged = [], []
    for tolerance in asked.tolerances:
        found = list[Climb]()
        takes = cost(lambda tolerance=tolerance, found=found: found.append(_climb(asked, tolerance)), repeats)  # type: ignore[misc]
        plan, reached = found[-1].solutions[0].plan, found[-1].reached
        name, chosen = f"{plan.grading} {plan.order}", tolerance == DEFAULT_TOLERANCE
        points.append(Choice(name, ASKED, takes.yardsticks, tolerance, chosen=chosen))
        points.append(Choice(name, STATED, takes.yardsticks, reached))
        judged.append(at_most(f"{asked.title}, {100 * tolerance:g} %", "stated over asked", reached / tolerance, 1.0))
    return Panel(asked.title, "error (ratio)", tuple(points)), judged


def _climb(asked: Climbed, tolerance: float) -> Climb:
    return climb(asked.scene, [asked.scene.press], tolerance=tolerance, strain=asked.strain, within_s=WITHIN_S)


def tolerances_chapter(asked: Sequence[Climbed] | None = None, repeats: int = 1) -> Chapter:
    """Return what tolerances take, as a table and as a figure."""
    panels, judged = zip(*(measured(one, repeats) for one in asked or CLIMBS), strict=True)
    return Chapter(
        "Time against tolerance",
        "The default inclusion at 1 mm, climbed to one tolerance after another as `host_tools simulate` does.",
        "host_tools/tradeoff/tolerance_times.py",
        tuple(benchmark for of_one in judged for benchmark in of_one),
        (front_table("Every tolerance", panels),),
        (front_figure("tradeoff_tolerances.svg", "Time against tolerance, by the sort of model", panels),),
        facts={"tolerance": DEFAULT_TOLERANCE},
    )
