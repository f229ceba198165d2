"""`host_tools table`, `phantom` and `import`: the simulated probe's tables, its recordings of phantoms, a bench's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from host_tools.commands.output import Scheduler, note, progress, require_writable_folder
from host_tools.commands.probe import ProbeOption, own_folder, probe_with_tables
from host_tools.workers import workers

if TYPE_CHECKING:
    from device.measurement.bundle import ModelBundle
    from device.simulation.scenario import Scenario
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.calibration.phantom_sets import Phantom
    from host_tools.scenes.probe import Probe

WIDE = Path("build/wide_table")
PARTS = ("centred", "off-axis", "layers", "motion", "tissue", "all", "wide", "derivatives")
PITCH_MM, PLAY_MM = 2.0, 0.02
FARTHEST_MM = 40.0
"""Largest offset of a press from the lesion: farther, the face comes near the edge of a phantom's slab."""


def table(
    out: Annotated[
        Path | None,
        typer.Option(help="Folder of the tables: models/simulated_probe, or build/wide_table of part wide."),
    ] = None,
    part: Annotated[
        str, typer.Option(help="centred, off-axis, layers, motion, tissue, or all of these; wide; or derivatives.")
    ] = "all",
    probe: ProbeOption = None,
    scheduler: Scheduler = None,
) -> None:
    """Build the virtual probe's tables of the pressed face: force ramps of centred inclusions, inclusions off the
    axis, what other layers of waveguide and tissue change, how far the face moves outwards, and tissue uneven in depth.

    All hold tissue of 2-30 kPa and 15-60 mm, but for stiffer or softer deep tissue, which is of the nominal slab. Three
    hours on two cores, most of it for other slabs.
    Part wide, some sixteen minutes of one core, is of inclusions around the trained ranges: `train --mode standard`
    needs it. Part derivatives, some twelve minutes on two, says how presses change with what a commissioning finds out;
    it needs the others.
    """
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.press_models.press_derivatives import sampled_derivatives, write_derivatives
    from host_tools.probe_tables.face_motion import build_face_motion, write_face_motion
    from host_tools.probe_tables.layer_table import build_layer_table, write_layer_table
    from host_tools.probe_tables.off_axis_table import build_off_axis_table, write_off_axis_table
    from host_tools.probe_tables.out_of_range_table import build_wide_table
    from host_tools.probe_tables.surface_table import build_surface_table, write_surface_table
    from host_tools.probe_tables.tissue_layers import build_tissue_layers, write_tissue_layers
    from host_tools.scenes.probe_file import probe_of

    if part not in PARTS:
        raise InvalidQuantity("part", part, " or ".join(PARTS), "name one of them")
    if probe and part == "wide":
        raise InvalidQuantity("part", part, "of the simulated probe", "leave --probe out: train reads no other yet")
    made_of = probe_of(probe)
    out = own_folder(probe, out or (WIDE if part == "wide" else None))
    with workers(scheduler), progress("solves") as bar:
        task = bar.add_task("")

        def on_point(done: int, n: int) -> None:
            bar.update(task, completed=done, total=n)

        if part == "derivatives":
            write_derivatives(*sampled_derivatives(ProbeTables.load(out)), out, made_of)
        if part == "wide":
            build_wide_table(on_point=on_point).save(out)
        if part in ("centred", "all"):
            write_surface_table(build_surface_table(waveguide=made_of.waveguide, on_point=on_point), out, made_of)
        if part in ("off-axis", "all"):
            write_off_axis_table(build_off_axis_table(waveguide=made_of.waveguide, on_point=on_point), out, made_of)
        if part in ("layers", "all"):
            write_layer_table(build_layer_table(waveguide=made_of.waveguide, on_point=on_point), out, made_of)
        if part in ("motion", "all"):
            write_face_motion(build_face_motion(waveguide=made_of.waveguide, on_point=on_point), out, made_of)
        if part in ("tissue", "all"):
            write_tissue_layers(build_tissue_layers(waveguide=made_of.waveguide, on_point=on_point), out, made_of)


def phantom(
    out: Annotated[Path, typer.Option(help="Folder of the recordings.")],
    which: Annotated[
        str | None, typer.Option("--set", help="calibration, breast-imager or random; calibration unless told.")
    ] = None,
    scenes: Annotated[int | None, typer.Option(help="With --set random: how many phantoms; 20.")] = None,
    scenario: Annotated[Path | None, typer.Option(help="Scenario file: what the probe is made of.")] = None,
    force_n: Annotated[list[float] | None, typer.Option(help="Force of the press; repeat for a ramp.")] = None,
    ramp: Annotated[
        bool, typer.Option("--ramp", help="Press the ramp of mode standard: ten frames from 0.08 to 0.60 N.")
    ] = False,
    offset_mm: Annotated[float, typer.Option(help="How far beside the lesion's middle it is pressed.")] = 0.0,
    model: Annotated[Path, typer.Option(help="Bundle whose phantom scenes to record.")] = MODELS / "paper",
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables.")] = SIMULATED_PROBE,
    seed: Annotated[int, typer.Option(min=0, help="Seed of scenes, camera, force and hand.")] = 100,
    probe: ProbeOption = None,
    phantoms: Annotated[
        Path | None, typer.Option(help="File of the phantoms to record instead of a set, phantoms.toml.")
    ] = None,
    camera_of: Annotated[
        Path | None,
        typer.Option(help="The probe's file whose camera geometry the recordings state, once a grid target told it."),
    ] = None,
    grid: Annotated[int | None, typer.Option(help="Record a grid target instead, so many times.")] = None,
    pitch_mm: Annotated[
        float | None, typer.Option(help=f"Of the grid: distance of its dots; {PITCH_MM:g} unless given.")
    ] = None,
    play_mm: Annotated[
        float | None,
        typer.Option(help=f"Of the grid: by how much its cap misses the face's middle; {PLAY_MM:g} unless given."),
    ] = None,
) -> None:
    """Record the simulated probe on phantoms: the model's nine, eight published ones, random ones or those of a file.

    With --grid they are of a grid target, as `host_tools probe camera` takes them.

    Another probe's recordings come from its own tables: name their folder with --table.

    Example: host_tools phantom --set random --scenes 5 --force-n 0.2 --force-n 0.4 --out build/random
    """
    from device.files.recording_file import write_recording
    from device.simulation.physics.pressed_face import ProbePlacement
    from device.simulation.scenario import Scenario, read_scenario
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.calibration.phantom import TARGET_N, PhantomProtocol, phantom_recording
    from host_tools.press_models.recorded_presses import protocol_of
    from host_tools.scenes.probe_file import probe_of

    require(
        "offset_mm", offset_mm, Bound(-FARTHEST_MM, FARTHEST_MM, "mm"), "press on the lesion, or a little beside it"
    )
    made_of = read_scenario(scenario) if scenario else Scenario()
    if ramp and force_n:
        raise InvalidQuantity("force_n", force_n, "not given with --ramp", "give one of them")
    held = PhantomProtocol(tuple(force_n or [TARGET_N]), place=ProbePlacement(x_mm=offset_mm))
    protocol = protocol_of("standard", offset_mm, 0.0) if ramp else held
    tables, made_by = ProbeTables.load(table), probe_with_tables(probe, table)
    stated_by = probe_of(camera_of) if camera_of else None
    _require_one_source({"--grid": grid is not None, "--phantoms": phantoms is not None, "--set": which is not None})
    if scenes is not None and which != "random":
        raise InvalidQuantity("scenes", scenes, "left out but with --set random", "say --set random, or leave it out")
    if grid is not None:
        if ramp or force_n or offset_mm or camera_of:
            bound = "given without --ramp, --force-n, --offset-mm and --camera-of"
            raise InvalidQuantity("grid", grid, bound, "leave these out: a grid is taken as it is")
        pitch_mm, play_mm = (PITCH_MM if pitch_mm is None else pitch_mm), (PLAY_MM if play_mm is None else play_mm)
        _record_grid(out, grid, pitch_mm, play_mm, made_of, tables, seed, made_by)
        return
    for name, value in (("pitch_mm", pitch_mm), ("play_mm", play_mm)):
        if value is not None:
            raise InvalidQuantity(name, value, "left out without --grid", "say --grid, or leave it out")
    chosen = list(_phantom_set(which or "calibration", model, 20 if scenes is None else scenes, seed, phantoms))
    in_tissues = [one.in_its_tissue(made_of) for one in chosen]
    _require_room([out / one.name for one in chosen])
    for i, (one, scene) in enumerate(zip(chosen, in_tissues, strict=True)):
        recording = phantom_recording(
            one.inclusion,
            tables,
            seed=seed + i,
            protocol=protocol,
            scenario=scene,
            ramps=one.ramps(),
            probe=made_by,
        )
        camera = recording.camera.seen_as(stated_by.geometry) if stated_by else recording.camera
        known = replace(recording, truth=one.truth, phantom_serial=one.set_serial, camera=camera)
        write_recording(known, out / one.name)
        note.print(f"{out / one.name}: {_told(one.truth)}")


def import_press(
    folder: Annotated[Path, typer.Argument(help="Folder of the frames: mono PNG or TIFF, 8 or 16 bit.")],
    probe: Annotated[Path, typer.Option(help="File of the probe that took them, probe.toml.")],
    out: Annotated[Path, typer.Option(help="New recording, NAME.zip or a folder; a phantom's has its name.")],
    exposure_us: Annotated[float, typer.Option(help="Exposure of the frames.")],
    started_at: Annotated[str, typer.Option(help="When the press began, 2026-11-02T09:30:00+01:00.")],
    gain: Annotated[float, typer.Option(help="Gain of the camera.")] = 1.0,
    frames: Annotated[
        Path | None,
        typer.Option(help="Table with the columns file, role, force_n, t_s; frames.csv in the folder by default."),
    ] = None,
) -> None:
    """Make a recording of frames that a bench took, from a folder of images and a table of forces.

    Roles are dark, reference and press. Everything that is wrong is named at once, by its line, and nothing is written.
    """
    from device.files.recording_file import write_recording
    from host_tools.calibration.bench_folder import PressOnBench, bench_recording
    from host_tools.scenes.probe_file import probe_of

    _require_room([out])
    name = out.stem if out.suffix == ".zip" else out.name
    press = PressOnBench(name, started_at, exposure_us, gain)
    recording = bench_recording(folder, frames or folder / "frames.csv", press, probe_of(probe))
    write_recording(recording, out)
    counts = ", ".join(f"{len(recording.with_role(role))} {role}" for role in ("dark", "reference", "press"))
    note.print(f"{out}: frames {counts}", soft_wrap=True)


def _record_grid(
    out: Path,
    count: int,
    pitch_mm: float,
    play_mm: float,
    scenario: Scenario,
    tables: ProbeTables,
    seed: int,
    probe: Probe | None,
) -> None:
    from device.files.recording_file import write_recording
    from device.simulation.grid_target import GridTarget
    from host_tools.calibration.phantom import grid_recordings

    require("grid", count, Bound(1, 1000, "recordings"), "record at least one")
    require("play_mm", play_mm, Bound(0.0, 1.0, "mm"), "give the play of the cap")
    target = GridTarget(pitch_mm, dot_mm=0.4 * pitch_mm, middle_dot_mm=0.6 * pitch_mm)
    _require_room([out / f"grid{number}" for number in range(1, count + 1)])
    made = grid_recordings(count, target, tables, play_mm=play_mm, seed=seed, scenario=scenario, probe=probe)
    for number, recording in enumerate(made, start=1):
        write_recording(recording, out / f"grid{number}")
        note.print(f"{out / f'grid{number}'}: dots every {pitch_mm:g} mm")


def _require_room(recordings: list[Path]) -> None:
    """Refuse to record where a recording is, before any is made."""
    for path in recordings:
        require_writable_folder(path.parent)
        if path.exists():
            raise InvalidQuantity("recording", path, "a new folder", "name another one with --out, or delete it first")


def _require_one_source(is_given: Mapping[str, bool]) -> None:
    """Refuse more than one word for what is pressed."""
    named = [word for word, given in is_given.items() if given]
    if len(named) > 1:
        raise InvalidQuantity("phantoms", " and ".join(named), "one of them", "say once what is pressed")


def _told(inclusion: Inclusion | None) -> str:
    if inclusion is None:
        return "a bare block"
    d, h, E = inclusion.as_tuple()
    return f"size {d:.2f} mm, depth {h:.2f} mm, Young's modulus {E:.1f} kPa"


def _phantom_set(which: str, model: Path, scenes: int, seed: int, phantoms: Path | None) -> Iterator[Phantom]:
    from device.files.bundle_file import read_paper_model
    from host_tools.calibration.phantom_sets import Phantom, breast_imager, of_file, random_set
    from host_tools.scenes.phantom_set import read_phantoms

    require("scenes", scenes, Bound(1, 100_000, "phantoms"), "record at least one")
    if phantoms:
        return of_file(read_phantoms(phantoms))
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
