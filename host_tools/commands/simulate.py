"""`host_tools simulate`: one scene, from options or a TOML file, by the cheapest model that holds a tolerance."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from device.files.durable import write_durably
from device.files.shipped import SIMULATED_PROBE
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from host_tools.commands.output import note, ratio_of, require_writable
from host_tools.commands.probe import ProbeOption, with_probe
from host_tools.scenes.scene import WITHIN_S, AskedStrain, Press, Scene

if TYPE_CHECKING:
    from host_tools.forward.ladder import Climb
    from host_tools.forward.solution import Solution

PLOTS, PICTURES, SCENES = (".png", ".pdf", ".svg"), (".png",), (".toml",)
IDEALISATIONS = {
    "half_width_departure": "a slab twice as wide",
    "dome_departure": "a first layer as much thicker as the dome is on average",
}
MOST_CORES = 2
"""To factorise stiffness with in 3-D: a scene then takes three quarters of the time; more were not tried."""
CANCELS = "not compared with the tolerance: what the centre gains under a force the rim loses"
UNITS = {"_n": "N", "_mm": "mm", "_mm2": "mm2", "_mm3": "mm3"}


def simulate(
    scene: Annotated[
        list[Path] | None,
        typer.Option(help="TOML file of the scene; the options below change it. Of several, a line of JSON each."),
    ] = None,
    size_mm: Annotated[float | None, typer.Option(help="Diameter of the inclusion; 0 for none.")] = None,
    depth_mm: Annotated[float | None, typer.Option(help="Surface to the top of the inclusion.")] = None,
    modulus_kpa: Annotated[float | None, typer.Option(help="Young's modulus of the inclusion.")] = None,
    tissue_modulus_kpa: Annotated[float | None, typer.Option(help="Young's modulus of the tissue.")] = None,
    poisson: Annotated[float | None, typer.Option(help="Poisson ratio of probe, tissue and inclusion.")] = None,
    offset_mm: Annotated[float | None, typer.Option(help="Inclusion's centre beside the probe's axis.")] = None,
    indentation_mm: Annotated[float | None, typer.Option(help="Prescribe the indentation (1 mm by default).")] = None,
    force_n: Annotated[float | None, typer.Option(help="Prescribe the force instead.")] = None,
    strain: Annotated[AskedStrain, typer.Option(help="Strain measure; auto asks the tolerance.")] = "auto",
    tolerance: Annotated[
        str | None, typer.Option(help="Relative error allowed on O1-O3, such as 1% or 0.01; 0.5% is aimed at.")
    ] = None,
    within_s: Annotated[float, typer.Option(help="Time to find a level that holds it, wall clock.")] = WITHIN_S,
    best: Annotated[bool, typer.Option("--best", help="Print the best, also if it misses the tolerance.")] = False,
    explain: Annotated[bool, typer.Option(help="Print which model was chosen, and why.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole solution as JSON.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Write a figure (PNG, PDF, SVG).")] = None,
    frame: Annotated[Path | None, typer.Option(help="Write a camera frame (PNG, 8 bit, scattered light).")] = None,
    save_scene: Annotated[Path | None, typer.Option(help="Write the scene, with every key of it (TOML).")] = None,
    exposure_us: Annotated[float, typer.Option(help="Exposure of the frame.")] = 4000.0,
    seed: Annotated[int, typer.Option(help="Seed of the frame's noise.")] = 1,
    probe: ProbeOption = None,
    light: Annotated[Path, typer.Option(help="Folder of the probe's table of light, for a frame.")] = SIMULATED_PROBE,
) -> None:
    """Solve one scene: deformation of the sensing face, contact pressure, force, and O1-O3 with their errors.

    The stated errors are compared with the tolerance, and higher levels are taken until they are within it. If none is,
    the exit code is 1 and a sentence says what was reached; with --best the numbers are printed all the same. So they
    are without --tolerance: then 0.5 % is aimed at, and the sentence says where it is missed.
    """
    require("within_s", within_s, Bound(0.0, 1e6, "s", low_included=False), "allow some time")
    _require_outputs(plot, frame, save_scene, exposure_us, seed)

    def asked_for(path: Path | None) -> Scene:
        base = with_probe(_read(path), probe)
        inclusion = _inclusion(base.inclusion, (size_mm, depth_mm, modulus_kpa), path)
        return _scene(base, inclusion, tissue_modulus_kpa, poisson, offset_mm, (indentation_mm, force_n))

    def climbed_to(one: Scene) -> Climb:
        return _climbed(one, tolerance, strain, within_s, best=best)

    if scene and len(scene) > 1:
        _require_no_files(scene, plot, frame, save_scene)
        _print_lines(scene, lambda path: _record(climbed_to(asked_for(path)), explain=explain))
        return
    asked = asked_for(scene[0] if scene else None)
    if save_scene:
        _save(asked, save_scene)
    climbed = climbed_to(asked)
    solution = climbed.solutions[0]
    if plot:
        _plot(solution, plot)
    if frame:
        _take_frame(solution, frame, exposure_us, seed, probe, light)
    _print(_record(climbed, explain=explain), as_json=as_json, explain=explain)
    if climbed.missed:
        note.print(climbed.missed, soft_wrap=True)


def _require_outputs(
    plot: Path | None, frame: Path | None, save_scene: Path | None, exposure_us: float, seed: int
) -> None:
    """Refuse what cannot be written, or no camera takes, before anything is computed."""
    for path, endings in ((plot, PLOTS), (frame, PICTURES), (save_scene, SCENES)):
        require_writable(path, endings)
    require("exposure_us", exposure_us, Bound(0.0, 1e7, "us", low_included=False), "expose for a while")
    require("seed", seed, Bound(0, 2**63, ""), "give a whole number from 0")


def _require_no_files(scenes: Sequence[Path], *files: Path | None) -> None:
    """Refuse to write one file of several scenes."""
    if written := [str(path) for path in files if path]:
        raise InvalidQuantity(
            "scene", f"{len(scenes)} files", f"one to write {', '.join(written)}", "call once for each"
        )


def _read(path: Path | None) -> Scene:
    """Return the file's scene, or the default one."""
    if path is None:
        return Scene()
    from host_tools.scenes.scene_file import read_scene

    return read_scene(path)


def _scene(
    base: Scene,
    inclusion: Inclusion | None,
    tissue_modulus_kpa: float | None,
    poisson: float | None,
    offset_mm: float | None,
    press: tuple[float | None, float | None],
) -> Scene:
    """Return a scene with what the options say instead."""
    tissue, place, probe = base.tissue, base.placement, base.waveguide
    if tissue_modulus_kpa is not None:
        tissue = replace(tissue, youngs_modulus_kpa=tissue_modulus_kpa)
    if poisson is not None:
        layers = tuple(replace(layer, poisson_ratio=poisson) for layer in tissue.layers)
        tissue = replace(tissue, poisson_ratio=poisson, layers=layers)
        place, probe = replace(place, poisson_ratio=poisson), replace(probe, poisson_ratio=poisson)
    if offset_mm is not None:
        place = replace(place, offset_x_mm=offset_mm, offset_y_mm=0.0)
    pressed = base.press if press == (None, None) else Press(*press)
    return Scene(inclusion, pressed, probe, tissue, place)


def _inclusion(
    base: Inclusion | None, unknowns: tuple[float | None, float | None, float | None], path: Path | None
) -> Inclusion | None:
    if base is not None:
        given = zip(base.as_tuple(), unknowns, strict=True)
        return Inclusion(*(known if asked is None else asked for known, asked in given))
    if path is not None and unknowns == (None, None, None):
        return None
    missing = [name for name, value in zip(("size", "depth", "modulus"), unknowns, strict=True) if value is None]
    if missing:
        raise InvalidQuantity(
            "inclusion", f"without {', '.join(missing)}", "whole", "give --size-mm, --depth-mm and --modulus-kpa"
        )
    return Inclusion(*(float(value) for value in unknowns if value is not None))


def _save(scene: Scene, path: Path) -> None:
    from host_tools.scenes.scene_file import write_scene

    write_scene(scene, path)


def _climbed(scene: Scene, tolerance: str | None, strain: AskedStrain, within_s: float, *, best: bool) -> Climb:
    """Return the cheapest solution that holds the tolerance; raise `ToleranceMissed` when none does, unless `best`.

    Where none was asked for the default is aimed at, and missing it is no failure.
    """
    from host_tools.forward.ladder import climb, held
    from host_tools.forward.plan import DEFAULT_TOLERANCE
    from host_tools.forward.small_strain.cores import on_cores

    aim = DEFAULT_TOLERANCE if tolerance is None else ratio_of(tolerance)
    takes_best = best or tolerance is None
    with on_cores(min(MOST_CORES, len(os.sched_getaffinity(0)))):
        climbed = climb(scene, [scene.press], tolerance=aim, strain=strain, within_s=within_s, best=takes_best)
    return held(climbed, best=takes_best)


def _record(climbed: Climb, *, explain: bool) -> dict[str, Any]:
    """Return what was reached as a JSON object; to explain it, with what idealisations of the scene depart by.

    So also of a thick slab: that it ends aside is then worth more than most errors, and nobody would ask.
    """
    solution = climbed.solutions[0]
    record = solution.as_record() | {"tolerance": climbed.as_record()}
    for errors in (record["stated_error"], record["tolerance"]):
        errors.update(
            {name: None for name, error in errors.items() if isinstance(error, float) and not isfinite(error)}
        )
    tissue = solution.scene.tissue
    if explain or tissue.thickness_mm > tissue.half_width_mm / 2:
        from host_tools.forward.model_departures import idealisation_departures

        record["plan"] |= idealisation_departures(solution.scene)
    return record


def _print_lines(paths: Sequence[Path], record_of: Callable[[Path], dict[str, Any]]) -> None:
    """Print a line of JSON for every file, as soon as it is there; exit with 1 where any was refused."""
    from host_tools.forward.press_model import PressFailed

    refused = False
    for path in paths:
        line: dict[str, Any] = {"scene": str(path)}
        try:
            line |= record_of(path)
        except (InvalidQuantity, PressFailed) as failed:
            line["refused"], refused = str(failed), True
        print(json.dumps(line), flush=True)
    if refused:
        raise typer.Exit(1)


def _plot(solution: Solution, path: Path) -> None:
    from host_tools.forward.plots import write_plot

    write_plot(solution, path)


def _take_frame(solution: Solution, path: Path, exposure_us: float, seed: int, probe: Path | None, light: Path) -> None:
    """Write the frame that the camera would take of the deformed face."""
    import cv2

    from host_tools.optics.frame import simulated_frame
    from host_tools.scenes.probe_file import probe_of

    frame = simulated_frame(solution, exposure_us=exposure_us, seed=seed, probe=probe_of(probe), light=light)
    # Not imwrite: on a full disk that leaves half a picture and says nothing.
    encoded = cv2.imencode(path.suffix, frame)[1]
    write_durably(path, encoded.tobytes())


def _print(record: dict[str, Any], *, as_json: bool, explain: bool) -> None:
    if as_json:
        print(json.dumps(record))
        return
    if explain:
        _print_plan(record["plan"])
    _print_solution(record)
    _print_idealisations(record["plan"])


def _print_plan(plan: dict[str, Any]) -> None:
    for choice, reason in plan["reasons"].items():
        value = f"{plan['grading']}, order {plan['order']}" if choice == "level" else plan[choice]
        print(f"{choice:12} {value:20} {reason}")


def _print_idealisations(plan: dict[str, Any]) -> None:
    for name, words in IDEALISATIONS.items():
        if name in plan:
            print(f"{name:26} {_percent(plan[name]):>12} %    from {words}; in no error above")


def _percent(ratio: float) -> str:
    """Return two digits, but all before the point."""
    return f"{100 * ratio:.2g}" if ratio < 1 else f"{100 * ratio:.0f}"


def _print_solution(record: dict[str, Any]) -> None:
    for name, value in record.items():
        unit = UNITS.get("_" + name.rpartition("_")[2])
        if unit and isinstance(value, float):
            error = record["stated_error"].get(name, 0.0)
            known = " +- unknown" if error is None else f" +- {100 * error:.3f} %" if error else ""
            excused = f"   {CANCELS}" if name in record["tolerance"]["not_compared"] else ""
            print(f"{name:26} {value:12.6g} {unit:4}{known}{excused}")
    print(f"{'pressure_is_positive':26} {record['pressure_is_positive']!s:>12}")
    departure = record["tolerance"]["small_strain_departure"]
    if departure != 0:
        shown = "unknown" if departure is None else f"{_percent(departure):>12} %   "
        is_stated = record["tolerance"]["departure_is_stated"]
        counted = "every error above has its own part in it" if is_stated else "in no error above"
        print(f"{'small_strain_departure':26} {shown} from finite strain, of any number at most; {counted}")
