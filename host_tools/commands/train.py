"""`host_tools train`: the paper's network from a data set, or the other modes' from the probe's tables."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from device import __version__
from device.measurement.inversion import ModelBundle
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from host_tools.commands.output import note, note_left_out, progress

MODELS = Path(__file__).resolve().parents[2] / "models"
SWEPT = Path("build/sweep.nc")
PAPER_SCENES = 134


def train(
    profile: Annotated[str, typer.Option(help="paper, standard (and precise), or quick (after standard).")] = "paper",
    data: Annotated[Path | None, typer.Option(help="Data set of `host_tools sweep`; swept unless given.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder of the model bundle.")] = None,
    trials: Annotated[int, typer.Option(help="Networks of the paper that are averaged.")] = 100,
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables.")] = MODELS / "simulated_probe",
    seed: Annotated[int, typer.Option(help="Seed of weights, splits, presses and noise.")] = 1,
    quick: Annotated[bool, typer.Option(help="A tenth of the presses: to try the chain, not to use.")] = False,
) -> None:
    """Train a model and export its bundle.

    Example: host_tools train --profile standard --out models/standard
    """
    if profile == "paper":
        _paper(data or _swept(), out or MODELS / "paper", trials, seed)
    elif profile == "standard":
        _standard(table, out or MODELS / "standard", seed, quick)
    elif profile == "quick":
        _quick(table, out or MODELS / "quick", seed)
    else:
        raise InvalidQuantity("profile", repr(profile), "paper, standard or quick", "choose one of them")


def _swept() -> Path:
    """Return the paper's data set, swept anew when it is not there."""
    from host_tools.commands.sweep import sweep

    if not SWEPT.exists():
        note.print(f"{SWEPT} is missing: sweeping {PAPER_SCENES} scenes.")
        sweep(out=SWEPT, scenes=PAPER_SCENES, seed=1)
    return SWEPT


def _paper(data: Path, out: Path, trials: int, seed: int) -> None:
    from host_tools.data.dataset import training_rows
    from host_tools.inverse.export import export
    from host_tools.inverse.train import train as run_training

    rows = training_rows(data)
    note_left_out(rows.excluded_rows, data)
    with progress("networks") as bar:
        task = bar.add_task("", total=trials)
        trained = run_training(
            rows, trials=trials, seed=seed, progress=lambda done, _: bar.update(task, completed=done)
        )
    command = f"host_tools train --data {data} --out {out} --trials {trials} --seed {seed}"
    with _refusals():
        export(trained, out, software_version=__version__, training_command=command)
    bundle = ModelBundle.load(out)
    print(f"{out}: {trials} networks from {len(rows.training_index)} scenes, model {bundle.sha256[:12]}")
    for unknown, errors in bundle.card["held_out_errors_percent"].items():
        if unknown in UNKNOWNS:
            print(f"{unknown:20} " + "  ".join(f"{name} {value:6.2f} %" for name, value in errors.items()))


def _standard(table: Path, out: Path, seed: int, quick: bool) -> None:
    from device.measurement.profile_model import ProfileModel
    from device.simulation.scenario import SERIALS
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.inverse.export_profile import export_profile
    from host_tools.inverse.profile_training import QUICK_EFFORT, Effort, train_profile

    effort = QUICK_EFFORT if quick else Effort()
    trained = train_profile(ProbeTables.load(table), effort=effort, seed=seed, say=note.print)
    command = f"host_tools train --profile standard --seed {seed}{' --quick' if quick else ''}"
    with _refusals():
        export_profile(
            trained, out, serials=(SERIALS["physical"],), software_version=__version__, training_command=command
        )
    _print_modes(out, ProfileModel.load(out).bundle)


def _quick(table: Path, out: Path, seed: int) -> None:
    from device.measurement.held_estimate import HeldModel
    from device.measurement.profile_model import ProfileModel
    from device.simulation.scenario import SERIALS
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.inverse.export_profile import export_quick
    from host_tools.inverse.quick_training import train_quick

    ramps = ProfileModel.load(MODELS / "standard").answers
    trained = train_quick(ProbeTables.load(table), ramps.surrogate, ramps.noise["standard"], seed=seed, say=note.print)
    command = f"host_tools train --profile quick --seed {seed}"
    with _refusals():
        export_quick(
            trained, out, serials=(SERIALS["physical"],), software_version=__version__, training_command=command
        )
    _print_modes(out, HeldModel.load(out).bundle)


@contextmanager
def _refusals() -> Iterator[None]:
    """Print why an export was refused and exit with code 1."""
    from host_tools.inverse.export import ExportRefused

    try:
        yield
    except ExportRefused as refused:
        note.print(str(refused), markup=False, soft_wrap=True)
        raise typer.Exit(1) from refused


def _print_modes(out: Path, bundle: ModelBundle) -> None:
    print(f"{out}: model {bundle.sha256[:12]}")
    for mode, entry in bundle.card["modes"].items():
        of_mode = entry["recorded"]
        errors = (f"{name} {of_mode[name]['mean_percent']:.1f} %" for name in UNKNOWNS)
        print(f"{mode:9} mean errors of {of_mode['presses']} recordings: {', '.join(errors)}")
