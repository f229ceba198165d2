"""`host_tools table` and `phantom`: the simulated probe's tables and its recordings of phantoms."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from host_tools.commands.output import Scheduler, note, own_models, progress
from host_tools.workers import workers

if TYPE_CHECKING:
    from device.measurement.bundle import ModelBundle
    from host_tools.calibration.phantom_sets import Phantom

WIDE = Path("build/wide_table")


def table(
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the tables: models/simulated_probe, or build/wide_table of part wide."),
    ] = None,
    part: Annotated[str, typer.Option(help="centred, off-axis or all, which are both; or wide.")] = "all",
    scheduler: Scheduler = None,
) -> None:
    """Build the virtual probe's tables of the pressed face: force ramps of centred inclusions, and inclusions off the
    axis.

    The first hold tissue of 4-6.25 kPa and 27-36 mm, the second is carried over to it. A quarter of an hour on two
    cores.
    Part wide, some ten minutes, is of inclusions around the trained ranges: `train --mode standard` needs it.
    """
    from host_tools.probe_tables.off_axis_table import build_off_axis_table, write_off_axis_table
    from host_tools.probe_tables.out_of_range_table import build_wide_table
    from host_tools.probe_tables.surface_table import build_surface_table, write_surface_table

    if part not in ("centred", "off-axis", "all", "wide"):
        raise InvalidQuantity("part", part, "centred, off-axis, all or wide", "name one of them")
    out = out or (WIDE if part == "wide" else own_models("simulated_probe"))
    with workers(scheduler), progress("solves") as bar:
        task = bar.add_task("")

        def on_point(done: int, n: int) -> None:
            bar.update(task, completed=done, total=n)

        if part == "wide":
            build_wide_table(on_point=on_point).save(out)
        if part in ("centred", "all"):
            write_surface_table(build_surface_table(on_point=on_point), out)
        if part in ("off-axis", "all"):
            write_off_axis_table(build_off_axis_table(on_point=on_point), out)


def phantom(
    out: Annotated[Path, typer.Option(help="Folder of the recordings.")],
    which: Annotated[str, typer.Option("--set", help="calibration, breast-imager or random.")] = "calibration",
    scenes: Annotated[int, typer.Option(help="How many random phantoms.")] = 20,
    scenario: Annotated[Path | None, typer.Option(help="Scenario file: what the probe is made of.")] = None,
    force_n: Annotated[list[float] | None, typer.Option(help="Force of the press; repeat for a ramp.")] = None,
    offset_mm: Annotated[float, typer.Option(help="How far beside the lesion's middle it is pressed.")] = 0.0,
    model: Annotated[Path, typer.Option(help="Bundle whose phantom scenes to record.")] = MODELS / "paper",
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables.")] = SIMULATED_PROBE,
    seed: Annotated[int, typer.Option(help="Seed of scenes, camera, force and hand.")] = 100,
) -> None:
    """Record the simulated probe on phantoms: the model's nine, eight published ones, or random ones.

    Example: host_tools phantom --set random --scenes 5 --force-n 0.2 --force-n 0.4 --out build/random
    """
    from device.files.recording_file import write_recording
    from device.simulation.physics.pressed_face import ProbePlacement
    from device.simulation.scenario import Scenario, read_scenario
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.calibration.phantom import TARGET_N, PhantomProtocol, phantom_recording

    made_of = read_scenario(scenario) if scenario else Scenario()
    protocol = PhantomProtocol(tuple(force_n or [TARGET_N]), place=ProbePlacement(x_mm=offset_mm))
    tables = ProbeTables.load(table)
    for i, one in enumerate(_phantom_set(which, model, scenes, seed)):
        recording = phantom_recording(
            one.inclusion, tables, seed=seed + i, protocol=protocol, scenario=made_of, ramps=one.ramps()
        )
        write_recording(recording, out / one.name)
        d, h, E = one.inclusion.as_tuple()
        note.print(f"{out / one.name}: size {d:.2f} mm, depth {h:.2f} mm, Young's modulus {E:.1f} kPa")


def _phantom_set(which: str, model: Path, scenes: int, seed: int) -> Iterator[Phantom]:
    from device.files.bundle_file import read_paper_model
    from host_tools.calibration.phantom_sets import Phantom, breast_imager, random_set

    require("scenes", scenes, Bound(1, 100_000, "phantoms"), "record at least one")
    if which == "breast-imager":
        return breast_imager()
    if which == "random":
        return random_set(scenes, seed)
    if which != "calibration":
        raise InvalidQuantity("set", repr(which), "calibration, breast-imager or random", "choose one of them")
    return (Phantom(f"phantom{i}", truth) for i, truth in enumerate(phantoms_of(read_paper_model(model)), start=1))


def phantoms_of(bundle: ModelBundle) -> list[Inclusion]:
    """Return the phantom scenes that a bundle was scored on."""
    rows = bundle.card.get("phantoms")
    if not rows:
        raise InvalidQuantity("phantoms", "missing in model.json", "the scored scenes", "train the model anew")
    return [Inclusion(*row) for row in rows]
