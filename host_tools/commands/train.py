"""`host_tools train`: the paper's network from a data set, the other modes' from the probe's tables, or everything.

Mode all runs the commands that make everything in models/ from nothing, one after the other. Each is a process of its
own, in the source tree: what a model card keeps as its command makes the same again alone.
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from device import __version__
from device.files.shipped import CERTIFICATES, MODELS, SIMULATED_PROBE
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from host_tools.commands.model import WIDE
from host_tools.commands.output import (
    Scheduler,
    note,
    note_left_out,
    own_models,
    progress,
    require_writable_folder,
    source_tree,
)
from host_tools.workers import workers

if TYPE_CHECKING:
    from device.measurement.bundle import ModelBundle
    from device.measurement.calibration import Calibration
    from device.simulation.virtual_probe import ProbeTables

CERTIFICATE = CERTIFICATES["physical"]
SWEPT = Path("build/sweep.nc")
PAPER_SCENES = 134
TRIALS = 100
SEED = 1
OWN_OPTIONS = {
    "paper": ("--out", "--data", "--trials"),
    "standard": ("--out", "--table", "--wide", "--dry-run", "--judge-only"),
    "quick": ("--out", "--table"),
    "commissioned": ("--out", "--table", "--wide", "--dry-run"),
    "all": (),
}
"""Options of each mode beside --seed and --scheduler; precise shares the bundle of standard, and so does what tells the
ranges of commissioned probes."""
OF_THE_CHAIN: dict[str, object] = {"--trials": TRIALS, "--seed": SEED, "--table": SIMULATED_PROBE, "--wide": WIDE}
"""What the chain takes, so that giving it makes the released model again; of --data nothing: who names a file may mean
another sweep, and none is checked there."""
PROBE, PHANTOMS = "models/simulated_probe", "build/phantoms"
ALL_OF = "/*"
"""Ends a word that stands for all files of a folder, once they are there."""
ON_A_CLUSTER = ("sweep", "table", "train")


def train(
    mode: Annotated[
        str,
        typer.Option(
            help="paper, standard (and precise), quick or commissioned (after standard: what tells the ranges of "
            "commissioned probes), or all."
        ),
    ] = "paper",
    data: Annotated[Path | None, typer.Option(help="Of paper: data set of `sweep`; swept unless given.")] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the model bundle; models/MODE unless given. Needed where another model than the released "
            "one is made, as by --data, --trials or --seed."
        ),
    ] = None,
    trials: Annotated[int | None, typer.Option(help="Of paper: networks that are averaged; 100 unless given.")] = None,
    table: Annotated[Path | None, typer.Option(help="Of the others: folder of the probe's tables.")] = None,
    wide: Annotated[
        Path | None,
        typer.Option(help="Of standard and commissioned: folder of the table around the ranges; made unless given."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of weights, splits, presses and noise.")] = SEED,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run",
            help="Of standard and commissioned: few presses, to try the chain; the model is a poor one. Needs --out.",
        ),
    ] = False,
    judge_only: Annotated[
        bool, typer.Option("--judge-only", help="Of standard: train nothing, judge the bundle's answers anew.")
    ] = False,
    scheduler: Scheduler = None,
) -> None:
    """Train a model and export its bundle.

    Mode all makes everything in models/ from nothing: data set, tables, light, certificates and the models of all
    modes, which it replaces: it takes no other --seed. It prints each command before it runs it, and takes some hours.

    Example: host_tools train --mode standard --out models/standard
    """
    from host_tools.paper_network.export import require_replaceable
    from host_tools.paper_network.train import require_trials

    given = {
        "--data": data,
        "--trials": trials,
        "--table": table,
        "--wide": wide,
        "--dry-run": dry_run or None,
        "--judge-only": judge_only or None,
    }
    if mode not in OWN_OPTIONS:
        raise InvalidQuantity("mode", repr(mode), f"one of {', '.join(OWN_OPTIONS)}", "choose one of them")
    for option, value in {"--out": out, **given}.items():
        if value is not None and option not in OWN_OPTIONS[mode]:
            raise InvalidQuantity("option", option, f"one of mode {mode}", "leave it out")
    if mode == "all":
        if seed != SEED:
            action = (
                f"train each mode with --seed and --out: {MODELS}, the released models, would be replaced by others"
            )
            raise InvalidQuantity("seed", seed, f"{SEED} with --mode all", action)
        return run_chain(chained_commands(scheduler), source_tree("make everything in models/"))
    if dry_run and out is None:
        raise InvalidQuantity("out", "not given", "given with --dry-run", "name a folder: its model is a poor one")
    if judge_only and wide:
        raise InvalidQuantity("wide", wide, "left out with --judge-only", "leave it out: what is there is judged")
    command = _command({"--mode": mode, **given, "--out": out, "--seed": seed})
    folder = out or own_models("standard" if mode == "commissioned" else mode)
    if out is None:
        _require_released({**given, "--seed": seed}, folder)
    require_writable_folder(folder)
    require_replaceable(folder)
    if mode == "paper":
        require_trials(TRIALS if trials is None else trials)
        data = _swept(scheduler) if data is None else data
    with workers(scheduler):
        if data is not None:
            _paper(data, folder, TRIALS if trials is None else trials, seed, command)
        elif judge_only:
            _judged(table or SIMULATED_PROBE, folder, seed, dry_run)
        elif mode == "standard":
            _standard(table or SIMULATED_PROBE, wide, folder, seed, dry_run, command)
        elif mode == "commissioned":
            _commissioned(table or SIMULATED_PROBE, wide, folder, seed, dry_run, command)
        else:
            _quick(table or SIMULATED_PROBE, folder, seed, command)


def _require_released(options: Mapping[str, object], folder: Path) -> None:
    """Raise `InvalidQuantity` for options by which the released model of a folder would be replaced by another."""
    others = [f"{name} {value}" for name, value in options.items() if value is not None and _is_other(name, value)]
    if others:
        action = f"name a folder: {folder}, the released model, would be replaced by another"
        raise InvalidQuantity("out", "not given", f"given with {' and '.join(others)}", action)


def _is_other(option: str, value: object) -> bool:
    """Return whether an option asks for something else than the chain."""
    usual = OF_THE_CHAIN.get(option)
    if isinstance(value, Path) and isinstance(usual, Path):
        return value.resolve() != usual.resolve()
    return value is not True and value != usual


def _command(options: Mapping[str, object]) -> str:
    """Return the command line that trains the same again."""
    given = {name: value for name, value in options.items() if value is not None}
    words = [[name] if value is True else [name, str(value)] for name, value in given.items()]
    return shlex.join(["host_tools", "train", *chain.from_iterable(words)])


def _swept(scheduler: str | None) -> Path:
    """Return the paper's data set, swept anew when it is not there; refuse another one of its name."""
    from host_tools.commands.sweep import sweep
    from host_tools.data.plan import SweepPlan
    from host_tools.data.sweep import holds

    if SWEPT.exists() and not holds(SWEPT, SweepPlan(PAPER_SCENES, seed=1)):
        bound = f"of {PAPER_SCENES} scenes of seed 1, as `host_tools sweep` makes it"
        raise InvalidQuantity("data set", f"{SWEPT}, of something else", bound, "name it with --data, or move it away")
    if not SWEPT.exists():
        note.print(f"{SWEPT} is missing: sweeping {PAPER_SCENES} scenes.")
        sweep(out=SWEPT, scenes=PAPER_SCENES, seed=1, scheduler=scheduler)
    return SWEPT


def _wide() -> Path:
    """Return the folder of the table around the trained ranges, made anew when it is not there."""
    from host_tools.commands.model import table
    from host_tools.probe_tables.out_of_range_table import NAME

    if not (WIDE / f"{NAME}.npz").exists():
        note.print(f"{WIDE} is missing: solving inclusions around the trained ranges.")
        table(part="wide")
    return WIDE


def _paper(data: Path, out: Path, trials: int, seed: int, command: str) -> None:
    from device.files.bundle_file import read_paper_model
    from host_tools.data.dataset import require_enough, training_rows
    from host_tools.paper_network.export import export
    from host_tools.paper_network.train import train as run_training

    rows = training_rows(data)
    note_left_out(rows.excluded_rows, data)
    require_enough(rows, data)
    with progress("networks") as bar:
        task = bar.add_task("", total=trials)
        trained = run_training(
            rows, trials=trials, seed=seed, progress=lambda done, _: bar.update(task, completed=done)
        )
    export(trained, out, software_version=__version__, training_command=command)
    bundle = read_paper_model(out)
    print(f"{out}: {trials} networks from {len(rows.training_index)} scenes, model {bundle.sha256[:12]}")
    for unknown, errors in bundle.card["held_out_errors_percent"].items():
        if unknown in UNKNOWNS:
            print(f"{unknown:20} " + "  ".join(f"{name} {value:6.2f} %" for name, value in errors.items()))


def _standard(table: Path, wide: Path | None, out: Path, seed: int, dry_run: bool, command: str) -> None:
    from device.files.certificate_file import read_calibration
    from device.simulation.scenario import SERIALS
    from host_tools.press_models.export import export_ramp
    from host_tools.press_models.ramp_training import DRY_RUN, TrainingBudget, train_ramp
    from host_tools.probe_tables.out_of_range_table import load_wide_table

    tables, calibration = _simulated_tables(table), read_calibration(table / CERTIFICATE)
    budget = DRY_RUN if dry_run else TrainingBudget()
    trained = train_ramp(tables, load_wide_table(wide or _wide()), budget=budget, seed=seed, say=note.print)
    export_ramp(trained, out, serials=(SERIALS["physical"],), software_version=__version__, training_command=command)
    _publish_ramp_dial(out, tables, calibration)


def _commissioned(table: Path, wide: Path | None, out: Path, seed: int, dry_run: bool, command: str) -> None:
    from device.files.bundle_file import read_ramp_model
    from host_tools.commissioning.joint_fit import Design
    from host_tools.commissioning.own_range import publish_own_range, train_own_range
    from host_tools.press_models.press_derivatives import load_derivatives
    from host_tools.press_models.ramp_training import DRY_RUN, TrainingBudget
    from host_tools.probe_tables.out_of_range_table import load_wide_table
    from host_tools.scores.scored_presses import tolerant

    model = read_ramp_model(out)
    answers = tolerant(Design(model.answers, load_derivatives(table)))
    tables, budget = _simulated_tables(table), (DRY_RUN if dry_run else TrainingBudget()).ranges
    found = train_own_range(
        tables, load_wide_table(wide or _wide()), answers, model.ranges, budget=budget, seed=seed, say=note.print
    )
    publish_own_range(out, found.trained, command)
    told = f"{100 * found.noticed:.0f} %, of the design's own {100 * found.noticed_by_design:.0f} %"
    print(f"{out}: of presses outside these networks notice {told}")


def _judged(table: Path, out: Path, seed: int, dry_run: bool) -> None:
    from device.files.certificate_file import read_calibration
    from host_tools.press_models.judge_bundle import judge_bundle
    from host_tools.press_models.ramp_training import DRY_RUN, TrainingBudget

    tables, calibration = _simulated_tables(table), read_calibration(table / CERTIFICATE)
    judge_bundle(out, tables, budget=DRY_RUN if dry_run else TrainingBudget(), seed=seed, say=note.print)
    _publish_ramp_dial(out, tables, calibration)


def _publish_ramp_dial(out: Path, tables: ProbeTables, calibration: Calibration) -> None:
    from device.files.bundle_file import read_ramp_model
    from device.measurement.ramp_modes.estimate import estimate_ramp
    from device.measurement.ramp_modes.model import RAMP_MODES
    from host_tools.scores.dial import publish_dial

    note.print("speed and accuracy of modes standard and precise")
    model = read_ramp_model(out)
    publish_dial(
        out,
        RAMP_MODES,
        lambda recording, mode: estimate_ramp(recording, mode, model, calibration),
        tables,
    )
    _print_modes(out, read_ramp_model(out).bundle)


def _quick(table: Path, out: Path, seed: int, command: str) -> None:
    from device.files.bundle_file import read_quick_model, read_ramp_model
    from device.files.certificate_file import read_calibration
    from device.measurement.quick_mode.model import estimate_quick
    from device.simulation.scenario import SERIALS
    from host_tools.press_models.export import export_quick
    from host_tools.press_models.quick_training import train_quick
    from host_tools.scores.dial import publish_dial

    tables, calibration = _simulated_tables(table), read_calibration(table / CERTIFICATE)
    standard = read_ramp_model(MODELS / "standard")
    ramps = standard.answers
    trained = train_quick(tables, ramps.surrogate, ramps.noise, seed=seed, say=note.print)
    export_quick(
        trained,
        out,
        surrogate_sha256=standard.bundle.card["surrogate_sha256"],
        serials=(SERIALS["physical"],),
        software_version=__version__,
        training_command=command,
    )
    note.print("speed and accuracy of mode quick")
    model = read_quick_model(out)
    publish_dial(out, ("quick",), lambda recording, _: estimate_quick(recording, model, calibration), tables)
    _print_modes(out, read_quick_model(out).bundle)


def _simulated_tables(folder: Path) -> ProbeTables:
    """Return the tables of a folder; refuse another probe's, since bundles are written for the simulated one."""
    from device.simulation.virtual_probe import SIMULATED_PROBE_SHA256, ProbeTables, probe_of_table

    tables, found = ProbeTables.load(folder), probe_of_table(folder, "surface_table")
    if found != SIMULATED_PROBE_SHA256:
        bound = f"{SIMULATED_PROBE_SHA256[:12]}, the simulated probe"
        raise InvalidQuantity("tables' probe", found[:12], bound, "train on the tables in models/simulated_probe")
    return tables


def _print_modes(out: Path, bundle: ModelBundle) -> None:
    print(f"{out}: model {bundle.sha256[:12]}")
    for mode, entry in bundle.card["modes"].items():
        of_mode = entry["recorded"]
        errors = (f"{name} {of_mode[name]['mean_percent']:.1f} %" for name in UNKNOWNS)
        print(f"{mode:9} mean errors of {of_mode['presses']} recordings: {', '.join(errors)}")


class ChainedCommand(NamedTuple):
    """The words of one command, and what it does not write over and so has to be gone."""

    words: tuple[str, ...]
    replaces: str | None = None


def chained_commands(scheduler: str | None = None) -> list[ChainedCommand]:
    """Return the chain, each command after those whose files it reads."""
    trained = ("--seed", str(SEED))
    commands = [
        ChainedCommand(("sweep", "--scenes", str(PAPER_SCENES), "--seed", "1", "--out", str(SWEPT))),
        ChainedCommand(("table", "--out", PROBE)),
        ChainedCommand(("optics", "build", "--out", PROBE)),
        ChainedCommand(("train", "--mode", "paper", "--data", str(SWEPT), "--out", "models/paper", *trained)),
        *_certified("physical"),
        *_certified("linear", "--scenario", "scenarios/linear_light.toml"),
        ChainedCommand(("table", "--part", "derivatives", "--out", PROBE)),
        ChainedCommand(("table", "--part", "wide")),
        ChainedCommand(("train", "--mode", "standard", "--out", "models/standard", *trained)),
        ChainedCommand(("train", "--mode", "quick", "--out", "models/quick", *trained)),
        ChainedCommand(("train", "--mode", "commissioned", "--out", "models/standard", *trained)),
    ]
    if scheduler is None:
        return commands
    on = ("--scheduler", scheduler)
    return [one._replace(words=(*one.words, *on)) if one.words[0] in ON_A_CLUSTER else one for one in commands]


def _certified(light: str, *scenario: str) -> tuple[ChainedCommand, ChainedCommand]:
    """Return what records the phantoms under a light and certifies the probe by them."""
    recorded, certificate = f"{PHANTOMS}/{light}", f"{PROBE}/{CERTIFICATES[light]}"
    words = ("calibrate", f"{recorded}{ALL_OF}", "--operator", "make train", "--out", certificate)
    return ChainedCommand(("phantom", *scenario, "--out", recorded), recorded), ChainedCommand(words, certificate)


def run_chain(commands: Iterable[ChainedCommand], tree: Path) -> None:
    """Run commands in the source tree until one fails, whose exit code then is this one's (`typer.Exit`)."""
    for one in commands:
        if one.replaces:
            _remove(tree / one.replaces)
        words = [word for given in one.words for word in _written_out(given, tree)]
        note.print(shlex.join(("host_tools", *words)), markup=False, soft_wrap=True)
        code = subprocess.run([sys.executable, "-m", "host_tools", *words], cwd=tree, check=False).returncode
        if code:
            note.print(f"This ended with {code}: correct it and go on from there.", markup=False, soft_wrap=True)
            raise typer.Exit(code if code > 0 else 1)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)


def _written_out(word: str, tree: Path) -> list[str]:
    """Return a word, or all files that it stands for."""
    if not word.endswith(ALL_OF):
        return [word]
    folder = word.removesuffix(ALL_OF)
    return sorted(f"{folder}/{path.name}" for path in (tree / folder).iterdir())
