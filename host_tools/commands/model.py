"""`host_tools table`, `train`, `phantom`, `calibrate`, `evaluate`: from a data set to a scored model bundle."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from device import __version__
from device.measurement.calibration import read_calibration
from device.measurement.durable import write_durably
from device.measurement.features import FEATURE_NAMES
from device.measurement.inversion import FEATURE_UNITS, ModelBundle
from device.measurement.quantities import UNKNOWNS, Inclusion, InvalidQuantity
from device.measurement.recording import read_recording, write_recording
from device.simulation.surface_table import load_surface_table
from host_tools.commands.output import note, progress

MODELS = Path(__file__).resolve().parents[2] / "models"


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
    with progress("networks") as bar:
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


def table(out: Annotated[Path, typer.Option(help="Folder of the table.")] = MODELS / "simulated_probe") -> None:
    """Build the virtual probe's table of deformed surfaces."""
    from host_tools.surface_table import build_surface_table, write_surface_table

    with progress("solves") as bar:
        task = bar.add_task("")
        built = build_surface_table(on_point=lambda done, n: bar.update(task, completed=done, total=n))
    write_surface_table(built, out)


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
