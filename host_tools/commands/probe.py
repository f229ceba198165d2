"""`host_tools probe`: the file of what a builder knows of a probe, that of the phantoms it is pressed on, its camera.

`camera` makes recordings of a grid target the camera's geometry; `camera-trial` says how well that does.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.commands.output import note, own_models, print_rows, problem_record, require_writable_folder

if TYPE_CHECKING:
    from device.files.toml_record import Record
    from host_tools.calibration.camera_fit import FittedCamera, GridPrint
    from host_tools.scenes.phantom_set import StatedPhantom
    from host_tools.scenes.probe import Probe
    from host_tools.scenes.scene import Scene

ProbeFile = Annotated[Path, typer.Argument(metavar="FILE", help="The probe's file, probe.toml.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object, also of what is wrong.")]
ProbeOption = Annotated[
    Path | None,
    typer.Option("--probe", help="The probe's file, probe.toml; the simulated probe unless given."),
]
"""Of every verb whose defaults are the simulated probe's."""
PitchMm = Annotated[float, typer.Option(help="Distance of the grid's dots.")]
PlayMm = Annotated[float, typer.Option(help="By how much the cap misses the face's middle, one standard deviation.")]

probe = typer.Typer(no_args_is_help=True, help="A probe as a file: what its builder knows of it, and of its phantoms.")


@probe.command(epilog="Example: host_tools probe new probe.toml --serial TSIS-0007")
def new(
    file: ProbeFile,
    serial: Annotated[str | None, typer.Option(help="Serial number of the probe; to be filled in without it.")] = None,
) -> None:
    """Write a file to fill in: the design of docs/build.md, with every tolerance left open."""
    from host_tools.scenes.probe_file import write_new_probe

    write_new_probe(file, serial)
    note.print(f'{file} written: fill in what stands behind "= ?", then run host_tools probe check {file}.')


@probe.command(epilog="Example: host_tools probe check probe.toml")
def check(file: ProbeFile, as_json: AsJson = False) -> None:
    """Name everything that is wrong in a probe's file at once; exit code 1 if there is anything.

    What can be built and commission refuses, as of another design, is told beside that; exit code 0.
    """
    from host_tools.commissioning.probe_prior import not_of_design
    from host_tools.scenes.probe_file import read_probe, simulated_probe

    found = _read(read_probe, file, as_json)
    advice = list(map(str, not_of_design(found, simulated_probe())))
    if as_json:
        told = {"accepted": True, "problems": [], "serial": found.serial, "sha256": found.sha256, "advice": advice}
        print(json.dumps(told))
        return
    thickness_mm = sum(layer.thickness_mm for layer in found.layers)
    print(f"{file}: probe {found.serial} can be built: {len(found.layers)} layers, {thickness_mm:g} mm together.")
    if advice:
        note.print("host_tools commission refuses it; look first whether its units are right:")
    for sentence in advice:
        note.print(sentence, soft_wrap=True)


@probe.command(epilog="Example: host_tools probe show models/simulated_probe/probe.toml")
def show(file: ProbeFile, as_json: AsJson = False) -> None:
    """Print a probe's numbers with tolerance and unit, and what follows from them."""
    from device.files.toml_record import as_table
    from host_tools.scenes.probe_file import read_probe
    from host_tools.scenes.stated import stated_rows

    found = _read(read_probe, file, as_json)
    follows = list(_consequences(found))
    if as_json:
        derived = {name: {"value": value, "unit": unit} for name, value, unit in follows}
        print(json.dumps({"accepted": True, "problems": [], "probe": as_table(found), "follows": derived}))
        return
    print_rows([("quantity", "value", "tolerance", "unit"), *stated_rows(found)])
    print()
    print_rows([("what follows", "value", "unit"), *((name, f"{value:.5g}", unit) for name, value, unit in follows)])
    print(f"\nTables of this probe are of {found.sha256[:12]}.")


def _consequences(found: Probe) -> Iterator[tuple[str, float, str]]:
    """Yield what follows from a probe's numbers: name, value, unit."""
    scale, (width_mm, height_mm) = found.scale, found.frame_mm
    yield "thickness_of_the_layers", sum(layer.thickness_mm for layer in found.layers), "mm"
    yield "central_window_radius", found.waveguide.central_radius_mm, "mm"
    yield "pixel_area", scale.area_mm2, "mm2"
    yield "pixel_width_over_height", scale.mm_per_px_x / scale.mm_per_px_y, ""
    yield "frame_width", width_mm, "mm"
    yield "frame_height", height_mm, "mm"
    yield "frame_height_over_face", height_mm / (2 * found.face.radius_mm), ""
    yield "force_of_one_count", 1 / found.cell.counts_per_n, "N"


WRITTEN = re.compile(rb"# Probe .+, (as stated|number \d+ within its tolerances)\.\n")
"""How a scene of a probe begins: such a file may be written anew."""


@probe.command(epilog="Example: host_tools probe scene probe.toml --out scene.toml, then make run SCENE=scene.toml")
def scene(
    file: ProbeFile,
    out: Annotated[Path, typer.Option(help="Scene file to write.")],
    number: Annotated[
        int | None, typer.Option(help="Which of the probes that are built within the tolerances; as stated without it.")
    ] = None,
) -> None:
    """Write a scene file in which the simulator is this probe, against which its models are another: press it, record
    phantoms with it, commission it. Moduli of the layers, LEDs, camera and load cell may be its own.
    """
    import tomli_w

    from device.files.durable import write_durably
    from host_tools.scenes.probe_file import read_probe, simulated_probe
    from host_tools.scenes.probe_scene import as_scene_table, scene_of_probe

    if number is not None:
        require("number", number, Bound(1, 10**6, ""), "give a whole number from 1")
    found = _read(read_probe, file, False)
    of_probe = as_scene_table(scene_of_probe(found, simulated_probe(), number))
    which = "as stated" if number is None else f"number {number} within its tolerances"
    if out.exists() and not WRITTEN.match(out.read_bytes()):
        raise InvalidQuantity(
            "out", out, "a new file, or a scene of a probe", "give another name: this one would be lost"
        )
    write_durably(out, (f"# Probe {found.serial}, {which}.\n" + tomli_w.dumps(of_probe)).encode())
    note.print(f"{out} written: make run SCENE={out} runs probe {found.serial}, {which}.", soft_wrap=True)


@probe.command(epilog="Example: host_tools probe phantoms phantoms.toml")
def phantoms(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file of the phantoms, phantoms.toml.")],
    as_json: AsJson = False,
) -> None:
    """Check the file of a set of phantoms and print it: everything that is wrong at once, with exit code 1."""
    from device.files.toml_record import as_table
    from host_tools.scenes.phantom_set import BLOCKS_NEEDED, read_phantoms

    found = _read(partial(read_phantoms, blocks_needed=BLOCKS_NEEDED), file, as_json)
    if as_json:
        advice = list(found.advice())
        print(json.dumps({"accepted": True, "problems": [], "set": as_table(found), "advice": advice}))
        return
    print_rows([PHANTOM_COLUMNS, *(_phantom_row(one) for one in found.phantoms)])
    inclusions = len(found.with_inclusion)
    print(f"\nset {found.serial}: {inclusions} with an inclusion, {len(found.phantoms) - inclusions} bare blocks.")
    for sentence in found.advice():
        note.print(sentence, soft_wrap=True)


PHANTOM_COLUMNS = ("phantom", "size mm", "depth mm", "modulus kPa", "tissue kPa", "thickness mm", "surface")


def _phantom_row(phantom: StatedPhantom) -> tuple[str, ...]:
    """Return a phantom as a row: each number with its tolerance."""
    from host_tools.scenes.phantom_set import INCLUSION, TISSUE
    from host_tools.scenes.stated import SUFFIX

    pairs = ((getattr(phantom, name), getattr(phantom, name + SUFFIX)) for name in (*INCLUSION, *TISSUE))
    numbers = ("-" if value is None else f"{value:g} +- {tolerance:g}" for value, tolerance in pairs)
    return phantom.name, *numbers, phantom.surface


@probe.command(epilog="Example: host_tools probe camera build/grid/* --probe probe.toml --write")
def camera(
    recordings: Annotated[list[Path], typer.Argument(help="Recordings of the grid, the cap put on anew for each.")],
    file: Annotated[Path | None, typer.Option("--probe", help="The probe's file, probe.toml, to compare with.")] = None,
    pitch_mm: PitchMm = 2.0,
    pitch_tolerance_mm: Annotated[float, typer.Option(help="How well that is known, one standard deviation.")] = 0.001,
    play_mm: PlayMm = 0.02,
    write: Annotated[bool, typer.Option("--write", help="Write what is found into the probe's file.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object, also of what is wrong.")] = False,
) -> None:
    """Find pixel sizes, optical axis and distortion of a camera from a grid target in a cap round the face.

    Reference frames show a blank plate, press frames the grid. What does not fit is named, all at once, and nothing is
    written; exit code 1.
    """
    from host_tools.calibration.camera_fit import GridPrint
    from host_tools.scenes.probe_file import read_probe

    if write and file is None:
        raise InvalidQuantity("probe", "not given", "given with --write", "name the probe's file with --probe")
    printed = GridPrint(pitch_mm, pitch_tolerance_mm, play_mm)
    try:
        found = _found(recordings, printed, read_probe(file) if file else None, file if write else None)
    except InvalidQuantity as refusal:
        if not as_json:
            raise
        problems: Iterable[InvalidQuantity] = getattr(refusal, "problems", [refusal])
        print(json.dumps({"accepted": False, "problems": [problem_record(one) for one in problems]}))
        raise typer.Exit(1) from refusal
    if as_json:
        print(json.dumps(_camera_record(found, recordings)))
    else:
        _show_camera(found, recordings, file if write else None)


def _found(recordings: list[Path], printed: GridPrint, known: Probe | None, file: Path | None) -> FittedCamera:
    """Return the fitted camera, once it is written into the file where there is one."""
    from device.files.recording_file import read_recording
    from host_tools.calibration.camera_fit import camera_of
    from host_tools.scenes.probe_file import write_camera

    for path in recordings:
        if recordings.count(path) > 1:
            raise InvalidQuantity("recordings", f"{path}, {recordings.count(path)} times", "each once", "name others")
    found = camera_of({str(path): read_recording(path) for path in recordings}, printed, known)
    if file:
        write_camera(file, found.as_probe_camera())
    return found


def _camera_record(found: FittedCamera, recordings: list[Path]) -> dict[str, Any]:
    numbers = {
        name: {"value": value, "deviation": deviation, "unit": unit} for name, value, deviation, unit in found.rows()
    }
    return {
        "accepted": True,
        "problems": [],
        "camera": numbers,
        "dots": found.dots,
        "recordings": len(recordings),
        "caps": [
            {"recording": str(path), "x_mm": float(x_mm), "y_mm": float(y_mm)}
            for path, (x_mm, y_mm) in zip(recordings, found.caps_mm, strict=True)
        ],
        "caps_checked": len(recordings) > 1,
        "left_mm": found.left_mm,
    }


def _show_camera(found: FittedCamera, recordings: list[Path], file: Path | None) -> None:
    rows = [(name, f"{value:.6g}", f"{deviation:.2g}", unit) for name, value, deviation, unit in found.rows()]
    print_rows([("quantity", "value", "1 sd", "unit"), *rows])
    print(f"\n{found.dots} dots in {len(recordings)} recordings, {1000 * found.left_mm:.2g} um from the grid (rms)")
    for line in _cap_lines(found, recordings):
        print(line)
    print("\n# settings of the daemon")
    print("[camera]", *(f"{name} = {value}" for name, value, _, _ in rows), sep="\n")
    if file:
        note.print(f"{file}: pixel sizes, axis and distortion written, with their tolerances.", soft_wrap=True)
        return
    print("\n# the same of probe.toml")
    print("[camera]", *(f"{name} = {value!r}" for name, value in found.as_probe_camera().items()), sep="\n")


def _cap_lines(found: FittedCamera, recordings: list[Path]) -> Iterator[str]:
    """Yield where each cap was; of a single one, that nothing tells it."""
    if len(recordings) == 1:
        yield "One recording: its cap was not checked, and the axis is wrong by what that misses the face's middle."
        return
    for path, (x_um, y_um) in zip(recordings, 1000 * found.caps_mm, strict=True):
        yield f"cap of {path}: {x_um:+.0f}, {y_um:+.0f} um from the face's middle"


@probe.command(epilog="Example: host_tools probe camera-trial scenarios/worlds/*.toml")
def camera_trial(
    worlds: Annotated[list[Path], typer.Argument(help="Scenario files of simulated probes.")],
    grids: Annotated[int, typer.Option(help="Recordings of the grid on each.")] = 4,
    play_mm: PlayMm = 0.02,
    seed: Annotated[int, typer.Option(min=0, help="Seed of caps, camera and press.")] = 1,
) -> None:
    """Print how far a grid target's camera is from the true one of each world, and what that makes of a press.

    The last columns are by how much a row of a press (standard mode, 0.001 of the light, rms over its columns) differs
    from the row of an ideal camera, before and after that camera is undone.
    """
    from host_tools.scores.camera_trial import trial_table

    for line in trial_table(worlds, grids=grids, play_mm=play_mm, seed=seed):
        print(line, flush=True)


def _read(read: Callable[[Path], Record], file: Path, as_json: bool) -> Record:
    """Return a file's record; what is wrong in it is raised, or printed as JSON with exit code 1."""
    try:
        return read(file)
    except InvalidQuantity as refusal:
        if not as_json:
            raise
        problems: Iterable[InvalidQuantity] = getattr(refusal, "problems", [refusal])
        print(json.dumps({"accepted": False, "problems": [problem_record(one) for one in problems]}))
        raise typer.Exit(1) from refusal


def with_probe(scene: Scene, probe: Path | None) -> Scene:
    """Return a scene pressed by the probe of a file; unchanged where none is given."""
    if probe is None:
        return scene
    from host_tools.scenes.probe_file import read_probe

    return replace(scene, waveguide=read_probe(probe).waveguide)


def probe_with_tables(probe: Path | None, table: Path) -> Probe | None:
    """Return the probe of a file, None where none is given; refuse a folder's tables that are of another one.

    Without a file they must be the simulated probe's.
    """
    from device.simulation.virtual_probe import probe_of_table
    from host_tools.scenes.probe_file import probe_of

    expected, found = probe_of(probe), probe_of_table(table, "surface_table")
    if found != expected.sha256:
        action = "name a probe's file with --probe and the folder of its own tables with --table"
        bound = f"{expected.sha256[:12]} of {expected.serial}"
        raise InvalidQuantity("surface table's probe", found[:12], bound, action)
    return expected if probe else None


def own_folder(probe: Path | None, out: Path | None) -> Path:
    """Return the folder of a probe's tables; another probe's never stand in the simulated one's by default.

    Refuse one that cannot be written.
    """
    if probe and out is None:
        bound = "given with --probe"
        raise InvalidQuantity("out", "not given", bound, "name a folder: models/simulated_probe is another probe's")
    folder = out or own_models("simulated_probe")
    require_writable_folder(folder)
    return folder
