"""`host_tools sweep` and `netcdf`: random scenes of the paper's box, or a probe's measurements, to one data set."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from device.measurement.quantities import InvalidQuantity
from host_tools.commands.output import Scheduler, note, progress, ratio_of
from host_tools.commands.probe import ProbeOption
from host_tools.scenes.scene import WITHIN_S, AskedStrain

if TYPE_CHECKING:
    from host_tools.data.plan import SweepPlan

INTERRUPTED = 130
"""Exit code of what Ctrl-C has ended."""


def sweep(
    out: Annotated[Path, typer.Option(help="netCDF file to write.")],
    scenes: Annotated[int, typer.Option(help="Number of random scenes.")] = 134,
    seed: Annotated[int, typer.Option(help="Seed of the scenes.")] = 1,
    force_n: Annotated[
        list[float] | None, typer.Option(help="Force of every press (0.5 N by default); repeat it for rising loads.")
    ] = None,
    strain: Annotated[
        AskedStrain | None, typer.Option(help="Strain measure: auto with a tolerance, small without, unless told.")
    ] = None,
    jobs: Annotated[int, typer.Option(help="Processes; -1 for all cores.")] = -1,
    force: Annotated[bool, typer.Option("--force", help="Replace a file that holds something else.")] = False,
    tolerance: Annotated[
        str | None, typer.Option(help="Every scene climbs until it states no more, such as 1%, or has failed.")
    ] = None,
    within_s: Annotated[
        float | None,
        typer.Option(
            help=f"With --tolerance: time of a scene to find a level that holds it, wall clock; {WITHIN_S:g} s."
        ),
    ] = None,
    probe: ProbeOption = None,
    scheduler: Scheduler = None,
) -> None:
    """Solve random scenes of the paper's box on all cores or a cluster; interrupted, the same command goes on.

    Without --tolerance all scenes share one level, and a row states what that level errs.

    Example: host_tools sweep --scenes 20 --tolerance 2% --out build/sweep.nc
    """
    from host_tools.data.plan import DEFAULT_FORCES_N, SweepPlan, asked_strain
    from host_tools.data.sweep import sweep as run_sweep
    from host_tools.scenes.probe_file import probe_of

    forces_n = tuple(force_n) if force_n else DEFAULT_FORCES_N
    allowed = None if tolerance is None else ratio_of(tolerance)
    measure = asked_strain(strain, allowed)
    if within_s is not None and allowed is None:
        raise InvalidQuantity("within_s", within_s, "left out without --tolerance", "give both, or none")
    limit_s = WITHIN_S if within_s is None else within_s
    plan = SweepPlan(scenes, seed, forces_n, measure, probe_of(probe).waveguide, allowed, limit_s)
    failed = 0
    with progress("scenes") as bar:
        task = bar.add_task("", total=scenes)

        def on_row(row: dict[str, Any], done: int) -> None:
            nonlocal failed
            failed += bool(row["reason"])
            bar.update(task, completed=done)

        try:
            run_sweep(plan, out, jobs=jobs, scheduler=scheduler, on_row=on_row, replace=force)
        except KeyboardInterrupt:
            note.print(f"Interrupted. Solved scenes are kept in {out}.partial: run the same command to go on.")
            raise typer.Exit(INTERRUPTED) from None
    note.print(f"{out}: {scenes} scenes, {failed} of those solved now failed.")
    if measure == "small":
        note.print(_departure(plan), soft_wrap=True)


def _departure(plan: SweepPlan) -> str:
    """Return a sentence on what no row of small strain states."""
    from host_tools.forward.model_departures import largest_departure
    from host_tools.forward.press_model import PressFailed

    try:
        departure = largest_departure(plan.middle_scene)
    except PressFailed:
        departure = inf
    much = f"{100 * departure:.0f} % in the middle of the box" if departure < inf else "more than could be found"
    return (
        f"In small strain, which may depart from finite strain by {much}: no row states that. With --tolerance and no "
        "--strain it counts."
    )


def netcdf(
    measurements: Annotated[Path, typer.Argument(help="File of `python -m device export` or of the API, NAME.npz.")],
    out: Annotated[Path, typer.Option(help="netCDF file to write, a new one.")],
) -> None:
    """Write measurements that a probe has exported as a netCDF data set with units."""
    from host_tools.data.exported import write_netcdf

    note.print(f"{out}: {write_netcdf(measurements, out)} measurements.")
