"""The command line of the toolkit: one verb a function. Exit codes: 0 ok, 1 failed, 2 usage."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import cv2
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from device import __version__
from device.measurement.calibration import read_calibration
from device.measurement.durable import write_durably
from device.measurement.features import FEATURE_NAMES
from device.measurement.inversion import FEATURE_UNITS, BundleRefused, ModelBundle
from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, InvalidQuantity, require
from device.measurement.recording import read_recording, write_recording
from device.simulation.surface_table import load_surface_table

MODELS = Path(__file__).resolve().parents[1] / "models"
PLOTS, PICTURES = (".png", ".pdf", ".svg"), (".png",)
app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Finite-element sweeps, training, calibration and scores of the tactile probe's model.",
)
note = Console(stderr=True, highlight=False)


def _progress(what: str) -> Progress:
    text = TextColumn(what)
    return Progress(text, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn(), console=note)


@app.command(epilog="Example: host_tools simulate --size-mm 10 --depth-mm 6 --modulus-kpa 80 --indentation-mm 1 --json")
def simulate(
    size_mm: Annotated[float, typer.Option(help="Diameter of the inclusion; 0 for none.")],
    depth_mm: Annotated[float, typer.Option(help="Surface to the top of the inclusion.")],
    modulus_kpa: Annotated[float, typer.Option(help="Young's modulus of the inclusion.")],
    indentation_mm: Annotated[float | None, typer.Option(help="Prescribe the indentation (1 mm by default).")] = None,
    force_n: Annotated[float | None, typer.Option(help="Prescribe the force instead.")] = None,
    tissue_modulus_kpa: Annotated[float, typer.Option(help="Young's modulus of the tissue.")] = 5.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole solution as JSON.")] = False,
    plot: Annotated[Path | None, typer.Option(help="Write a figure (PNG, PDF, SVG).")] = None,
    frame: Annotated[Path | None, typer.Option(help="Write a camera frame (PNG, 8 bit, linear optics).")] = None,
    exposure_us: Annotated[float, typer.Option(help="Exposure of the frame.")] = 4000.0,
    seed: Annotated[int, typer.Option(help="Seed of the frame's noise.")] = 1,
) -> None:
    """Solve one scene: deformation of the sensing face, contact pressure, force, and O1-O3."""
    from host_tools.forward.solve import order_difference, solve
    from host_tools.scene import Press, Scene, Tissue

    _require_writable(plot, PLOTS)
    _require_writable(frame, PICTURES)
    require("exposure_us", exposure_us, Bound(0.0, 1e7, "us", low_included=False), "expose for a while")
    require("seed", seed, Bound(0, 2**63, ""), "give a whole number from 0")
    indentation_mm = 1.0 if indentation_mm is None and force_n is None else indentation_mm
    press = Press(indentation_mm=indentation_mm, force_n=force_n)
    tissue = Tissue(youngs_modulus_kpa=tissue_modulus_kpa)
    scene = Scene(Inclusion(size_mm, depth_mm, modulus_kpa), press, tissue=tissue)
    solution = solve(scene)
    stated_error = order_difference(scene, solution)
    if plot:
        from host_tools.plots import plot_solution

        plot_solution(solution, plot)
    if frame:
        from host_tools.frame import simulated_frame

        cv2.imwrite(str(frame), simulated_frame(solution, exposure_us=exposure_us, seed=seed))
    record = solution.as_record() | {"stated_error": stated_error}
    if as_json:
        print(json.dumps(record))
    else:
        _print_solution(record)


def _require_writable(path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Refuse a file that could not be written before minutes are spent on what it would hold."""
    if path and path.suffix.lower() not in suffixes:
        raise InvalidQuantity("file", path, f"of type {', '.join(suffixes)}", "give it another name")
    if path and not path.parent.is_dir():
        raise InvalidQuantity("folder", path.parent, "a folder that exists", "make it first")


def _print_solution(record: dict[str, Any]) -> None:
    units = {"_n": "N", "_mm": "mm", "_mm2": "mm2", "_mm3": "mm3"}
    for name, value in record.items():
        unit = units.get("_" + name.rpartition("_")[2])
        if unit and isinstance(value, float):
            error = record["stated_error"].get(name)
            print(f"{name:26} {value:12.6g} {unit:4}" + (f" +- {100 * error:.3f} %" if error is not None else ""))
    print(f"{'pressure_is_positive':26} {record['pressure_is_positive']!s:>12}")


@app.command(epilog="Example: host_tools sweep --scenes 134 --seed 1 --out build/sweep.nc")
def sweep(
    out: Annotated[Path, typer.Option(help="netCDF file to write.")],
    scenes: Annotated[int, typer.Option(help="Number of random scenes.")] = 134,
    seed: Annotated[int, typer.Option(help="Seed of the scenes.")] = 1,
    force_n: Annotated[float, typer.Option(help="Force of every press.")] = 0.5,
    jobs: Annotated[int, typer.Option(help="Processes; -1 for all cores.")] = -1,
) -> None:
    """Solve random scenes of the paper's box on all cores; interrupted, the same command goes on."""
    from host_tools.data.sweep import SweepPlan
    from host_tools.data.sweep import sweep as run_sweep

    failed = 0
    with _progress("scenes") as bar:
        task = bar.add_task("", total=scenes)

        def on_row(row: dict[str, Any], done: int) -> None:
            nonlocal failed
            failed += bool(row["reason"])
            bar.update(task, completed=done)

        try:
            run_sweep(SweepPlan(scenes, seed, force_n), out, jobs=jobs, on_row=on_row)
        except KeyboardInterrupt:
            note.print(f"Interrupted. Solved scenes are kept in {out}.partial: run the same command to go on.")
            raise typer.Exit(1) from None
    note.print(f"{out}: {scenes} scenes, {failed} of those solved now failed.")


@app.command(epilog="Example: host_tools train --data build/sweep.nc --out models/paper")
def train(
    data: Annotated[Path, typer.Option(help="Data set of `host_tools sweep`.")],
    out: Annotated[Path, typer.Option(help="Folder of the model bundle.")],
    trials: Annotated[int, typer.Option(help="Networks that are averaged.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of weights and splits.")] = 1,
) -> None:
    """Train the 3-10-4-3 network by scaled conjugate gradient and export the bundle."""
    from host_tools.data.dataset import training_rows
    from host_tools.inverse.export import ExportRefused, export
    from host_tools.inverse.train import train as run_training

    rows = training_rows(data)
    if rows.excluded_rows:
        note.print(f"{rows.excluded_rows} failed scenes of {data} are left out.")
    with _progress("networks") as bar:
        task = bar.add_task("", total=trials)
        trained = run_training(
            rows, trials=trials, seed=seed, progress=lambda done, _: bar.update(task, completed=done)
        )
    command = f"host_tools train --data {data} --out {out} --trials {trials} --seed {seed}"
    try:
        export(trained, out, software_version=__version__, training_command=command)
    except ExportRefused as refused:
        note.print(str(refused), markup=False, soft_wrap=True)
        raise typer.Exit(1) from refused
    bundle = ModelBundle.load(out)
    print(f"{out}: {trials} networks from {len(rows.training_index)} scenes, model {bundle.sha256[:12]}")
    for unknown, errors in bundle.card["held_out_errors_percent"].items():
        if unknown in UNKNOWNS:
            print(f"{unknown:20} " + "  ".join(f"{name} {value:6.2f} %" for name, value in errors.items()))


@app.command(epilog="Example: host_tools table --out models/simulated_probe")
def table(out: Annotated[Path, typer.Option(help="Folder of the table.")] = MODELS / "simulated_probe") -> None:
    """Build the virtual probe's table of deformed surfaces."""
    from host_tools.surface_table import build_surface_table, write_surface_table

    with _progress("solves") as bar:
        task = bar.add_task("")
        built = build_surface_table(on_point=lambda done, n: bar.update(task, completed=done, total=n))
    write_surface_table(built, out)


@app.command(epilog="Example: host_tools phantom --out build/phantoms")
def phantom(
    out: Annotated[Path, typer.Option(help="Folder of the recordings.")],
    model: Annotated[Path, typer.Option(help="Bundle whose phantom scenes to record.")] = MODELS / "paper",
    table: Annotated[Path, typer.Option(help="Folder of the surface table.")] = MODELS / "simulated_probe",
    seed: Annotated[int, typer.Option(help="Seed of camera, force and hand.")] = 100,
) -> None:
    """Record the simulated probe on the model's nine phantom scenes."""
    from host_tools.phantom import phantom_recording

    surfaces = load_surface_table(table)
    for i, truth in enumerate(_phantoms(model)):
        write_recording(phantom_recording(truth, surfaces, seed=seed + i), out / f"phantom{i + 1}")
        d, h, E = truth.as_tuple()
        note.print(f"{out / f'phantom{i + 1}'}: size {d:.2f} mm, depth {h:.2f} mm, Young's modulus {E:.1f} kPa")


def _phantoms(model: Path) -> list[Inclusion]:
    """Return the phantom scenes that a bundle was scored on."""
    rows = ModelBundle.load(model).card.get("phantoms")
    if not rows:
        raise InvalidQuantity("phantoms", "missing in model.json", "the scored scenes", "train the model anew")
    return [Inclusion(*row) for row in rows]


@app.command(epilog="Example: host_tools calibrate build/phantoms/* --out models/simulated_probe/calibration.json")
def calibrate(
    recordings: Annotated[list[Path], typer.Argument(help="Phantom recordings with truth.")],
    out: Annotated[Path, typer.Option(help="Certificate to write.")],
    model: Annotated[Path, typer.Option(help="Bundle the certificate is for.")] = MODELS / "paper",
    table: Annotated[Path, typer.Option(help="Folder of the surface table.")] = MODELS / "simulated_probe",
    force_n: Annotated[float, typer.Option(help="Force the probe is pressed with.")] = 0.5,
) -> None:
    """Fit the three regressions from image to deformation features and write the certificate."""
    from host_tools.calibrate import calibrate as run_calibration

    certificate = run_calibration(
        [read_recording(path) for path in recordings],
        ModelBundle.load(model),
        load_surface_table(table),
        force_n=force_n,
    )
    write_durably(out, certificate.to_json().encode())
    for image, line, name in zip(FEATURE_NAMES, certificate.regressions, FEATURE_UNITS, strict=True):
        law = f"{name} = {line.slope:.4g} {image} {line.intercept:+.3g}"
        print(f"{law:76} R2 {line.r_squared:.5f}  leave-one-out {line.leave_one_out_std:.3g}")


@app.command(epilog="Example: host_tools evaluate --scenes 40")
def evaluate(
    model: Annotated[Path, typer.Option(help="Bundle to score.")] = MODELS / "paper",
    table: Annotated[Path, typer.Option(help="Folder of the surface table.")] = MODELS / "simulated_probe",
    scenes: Annotated[int, typer.Option(help="Random scenes for the coverage of the intervals.")] = 100,
    seed: Annotated[int, typer.Option(help="Seed of scenes, camera and hand.")] = 1000,
) -> None:
    """Score the model on its nine phantoms, noise-free and through the camera, and its intervals on random scenes."""
    from host_tools.score import Rig, print_intervals, print_phantoms

    rig = Rig(ModelBundle.load(model), read_calibration(table / "calibration.json"), load_surface_table(table))
    out = Console(width=110, highlight=False)
    print_phantoms(rig, _phantoms(model), seed=seed, out=out)
    if scenes:
        print_intervals(rig, scenes=scenes, seed=seed, out=out)


def main() -> None:
    """Run the command line; what cannot be used is one sentence and exit code 1."""
    try:
        app()
    except (InvalidQuantity, BundleRefused, OSError) as error:
        note.print(str(error), markup=False, soft_wrap=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
