"""`host_tools evaluate`: scores of recordings with truth, or of random presses of the simulated probe, in any mode.

With --noise-free and --posterior it prints modes standard and precise beside the best: the chapters are those of
`host_tools modes`, on presses of another seed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.console import Console

from device.files.bundle_file import read_models, read_paper_model, read_ramp_model
from device.files.certificate_file import read_calibration
from device.files.recording_file import read_recording
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.bundle import ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode, mode_named
from device.measurement.mode_models import ModeModels, analysed
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.model import RAMP_MODES
from device.measurement.recording.recording import Recording
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.commands.measured_chapters import measure_chapters, print_chapter, print_table
from host_tools.commands.model import phantoms_of
from host_tools.commands.output import note

if TYPE_CHECKING:
    from host_tools.pages.benchmark import Chapter


def print_reference(
    model: Path, table: Path, mode: Mode | None, *, noise_free: bool, posterior: bool, scenes: int | None, seed: int
) -> None:
    """Print the chapters that are asked for, on `scenes` presses or as many as `host_tools modes` takes.

    Both modes unless one is given. Raises `InvalidQuantity` for one that fits no forward model; exits with code 1 when
    a figure misses its bound.
    """
    from host_tools.scores.noise_free import PRESSES, noise_free_chapter
    from host_tools.scores.posterior import SCENES, posterior_chapter

    modes = _ramp_modes(mode)
    trained, tables = read_ramp_model(model), ProbeTables.load(table)
    chapters: dict[str, Callable[[], Chapter]] = {}
    if noise_free:
        presses = PRESSES if scenes is None else scenes
        chapters["noise-free"] = lambda: noise_free_chapter(trained.answers, tables, presses=presses, seed=seed)
    if posterior:
        count = SCENES if scenes is None else scenes
        chapters["posterior"] = lambda: posterior_chapter(trained, modes=modes, scenes=count, seed=seed)
    missed, out = 0, Console(width=160, highlight=False)
    for timed in measure_chapters(chapters).values():
        missed += print_chapter(timed)
        out.print(timed.chapter.claim, markup=False)
        for shown in timed.chapter.tables:
            print_table(shown)
    if missed:
        raise typer.Exit(1)


def _ramp_modes(mode: Mode | None) -> tuple[Mode, ...]:
    if mode is None:
        return RAMP_MODES
    if mode not in RAMP_MODES:
        raise InvalidQuantity("mode", mode, " or ".join(RAMP_MODES), "only they have a forward model to compare with")
    return (mode,)


if TYPE_CHECKING:
    from host_tools.scores.score_recordings import LeastErrors, Sample

CERTIFICATES = {"physical": "calibration.json", "linear": "calibration_linear.json"}
SCENES = 100


def evaluate(
    recordings: Annotated[
        list[Path] | None, typer.Argument(help="Recordings with truth; random presses if none.")
    ] = None,
    mode: Annotated[str, typer.Option(help="quick, standard, precise or paper; that of the frames by default.")] = "",
    model: Annotated[Path, typer.Option(help="Bundle of mode paper.")] = MODELS / "paper",
    quick_model: Annotated[Path, typer.Option(help="Bundle of mode quick.")] = MODELS / "quick",
    standard_model: Annotated[Path, typer.Option(help="Bundle of modes standard and precise.")] = MODELS / "standard",
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables and certificates.")] = SIMULATED_PROBE,
    light: Annotated[str, typer.Option(help="physical, or linear for the paper's straight line.")] = "physical",
    scenes: Annotated[
        int | None, typer.Option(help="Random presses; 100, 160 without noise, 50 beside the posterior by default.")
    ] = None,
    seed: Annotated[int, typer.Option(help="Seed of scenes, camera and hand.")] = 1000,
    noise_free: Annotated[
        bool, typer.Option("--noise-free", help="Instead: ramps without noise, tissue and skin told.")
    ] = False,
    posterior: Annotated[
        bool, typer.Option("--posterior", help="Instead: errors over those of the reference posterior; minutes.")
    ] = False,
) -> None:
    """Score what the device answers: on recordings, or on random presses with every drift.

    In mode paper without recordings: the model's nine phantoms, noise-free and through the camera, and random scenes.
    With --noise-free or --posterior, of modes standard and precise: exit code 1 when a figure misses its bound.

    Example: host_tools evaluate --mode precise --scenes 50
    """
    from host_tools.scores.score_recordings import print_score, score

    out = Console(width=110, highlight=False)
    asked = mode_named(mode) if mode else None
    if noise_free or posterior:
        if recordings:
            raise InvalidQuantity("recordings", len(recordings), "none", "leave out --noise-free and --posterior")
        print_reference(
            standard_model, table, asked, noise_free=noise_free, posterior=posterior, scenes=scenes, seed=seed
        )
        return
    scenes = SCENES if scenes is None else scenes
    certificate = read_calibration(table / _certificate(light))
    if not recordings and asked in (None, "paper"):
        _print_paper(read_paper_model(model), certificate, table, light, scenes, seed, out)
        return
    models = read_models(read_paper_model(model), quick_model, standard_model)

    def answer(recording: Recording) -> Estimate:
        return analysed(recording, models, certificate, asked)

    samples = _named(recordings) if recordings or not asked else _random_presses(asked, table, scenes, seed)
    say = partial(note.print, markup=False, soft_wrap=True)
    print_score(score(samples, answer, say, _bound_of(models)), out)


def _bound_of(models: ModeModels) -> LeastErrors:
    """Return what bounds the errors of standard and precise; the bundles of the other modes hold no forward model."""
    from host_tools.cramer_rao.press_bound import least_errors
    from host_tools.scores.score_recordings import unbounded

    return partial(least_errors, models.ramp.answers) if models.ramp else unbounded


def _certificate(light: str) -> str:
    if light not in CERTIFICATES:
        raise InvalidQuantity("light", repr(light), f"one of {', '.join(CERTIFICATES)}", "choose one of them")
    return CERTIFICATES[light]


def _print_paper(
    bundle: ModelBundle, certificate: Calibration, table: Path, light: str, scenes: int, seed: int, out: Console
) -> None:
    from host_tools.scores.paper_scores import Rig, print_intervals, print_phantoms

    rig = Rig(bundle, certificate, ProbeTables.load(table), Scenario(light=light))
    print_phantoms(rig, phantoms_of(bundle), seed=seed, out=out)
    if scenes:
        print_intervals(rig, scenes=scenes, seed=seed, out=out)


def _named(paths: list[Path] | None) -> Iterator[Sample]:
    from host_tools.scores.score_recordings import Sample

    return (Sample(str(path), partial(read_recording, path)) for path in paths or [])


def _random_presses(mode: Mode, table: Path, scenes: int, seed: int) -> Iterator[Sample]:
    """Yield presses over the trained ranges that no training has seen, with every drift."""
    from device.measurement.parameters import PARAMETERS
    from device.measurement.ramp_modes.noise import ErrorLevels
    from host_tools.press_models.press_samples import draw_parameters
    from host_tools.press_models.recorded_presses import recorded_press
    from host_tools.press_models.seeds import press_seed
    from host_tools.scores.score_recordings import Sample

    tables = ProbeTables.load(table)
    for number, parameters in enumerate(draw_parameters(scenes, np.random.default_rng([seed, 3]))):
        yield Sample(
            f"press {number}",
            partial(recorded_press, tables, parameters, mode, press_seed(seed, number), levels=ErrorLevels()),
            dict(zip(PARAMETERS, map(float, parameters), strict=True)),
        )
