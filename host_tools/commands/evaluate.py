"""`host_tools evaluate`: scores of recordings with truth, or of random presses of the simulated probe, in any mode.

With --noise-free and --posterior it prints mode standard beside the best, with --scan what each further ramp of mode
precise tells: the chapters are those of `host_tools modes`, on presses of another seed.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from device.files.shipped import CERTIFICATES, MODELS, SIMULATED_PROBE
from device.measurement.mode import Mode, mode_named
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.commands.measured_chapters import measure_chapters, print_chapter, print_table
from host_tools.commands.model import phantoms_of
from host_tools.commands.output import Scheduler, note
from host_tools.workers import workers

if TYPE_CHECKING:
    from device.measurement.calibration import Calibration
    from device.measurement.mode_models import ModeModels
    from host_tools.pages.benchmark import Chapter
    from host_tools.pages.page import Timed
    from host_tools.scenes.phantom_set import PhantomSet
    from host_tools.scores.score_recordings import LeastErrors, Sample

CERTIFICATE = CERTIFICATES["physical"]
SCENES = 100
REFERENCES: dict[str, Mode] = {"noise-free": "standard", "posterior": "standard", "scan": "precise"}
"""Chapters that are printed instead of a score, and the mode that each is of."""


def evaluate(
    recordings: Annotated[
        list[Path] | None, typer.Argument(help="Recordings with truth; random presses if none.")
    ] = None,
    mode: Annotated[str, typer.Option(help="quick, standard, precise or paper; that of the frames by default.")] = "",
    model: Annotated[Path, typer.Option(help="Bundle of mode paper.")] = MODELS / "paper",
    quick_model: Annotated[Path, typer.Option(help="Bundle of mode quick.")] = MODELS / "quick",
    standard_model: Annotated[Path, typer.Option(help="Bundle of modes standard and precise.")] = MODELS / "standard",
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables and certificates.")] = SIMULATED_PROBE,
    calibration: Annotated[
        Path | None,
        typer.Option(
            help="Certificate; for recordings calibration.json beside --standard-model by default, else the table's."
        ),
    ] = None,
    phantoms: Annotated[
        Path | None,
        typer.Option(help="File of the phantoms, phantoms.toml: truth and tissue of recordings named as they are."),
    ] = None,
    light: Annotated[str, typer.Option(help="physical, or linear for the paper's straight line.")] = "physical",
    scenes: Annotated[
        int | None,
        typer.Option(help="Random presses; 100, 160 without noise, 200 beside the posterior, 160 scans by default."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of scenes, camera and hand.")] = 1000,
    noise_free: Annotated[
        bool, typer.Option("--noise-free", help="Instead: ramps without noise, tissue and skin told.")
    ] = False,
    posterior: Annotated[
        bool, typer.Option("--posterior", help="Instead: errors over those of the reference posterior; minutes.")
    ] = False,
    scan: Annotated[
        bool, typer.Option("--scan", help="Instead: scans of one to four ramps, simulated by the surrogate; minutes.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print every number as one JSON object.")] = False,
    scheduler: Scheduler = None,
) -> None:
    """Score what the device answers: on recordings, or on random presses with every drift.

    In mode paper without recordings: the model's nine phantoms, noise-free and through the camera, and random scenes.
    With --noise-free, --posterior or --scan: exit code 1 when a figure misses its bound.

    A commissioned probe of one's own is scored by its bundle, in which its certificate stands, on castings that it was
    not commissioned on. Bundles and certificate of two commissionings are refused, as the daemon does.

    Examples: host_tools evaluate --mode precise --scenes 50

    host_tools evaluate presses/* --standard-model models/TSIS-0007 --phantoms phantoms.toml
    """
    asked = mode_named(mode) if mode else None
    _require_named({"quick": quick_model, "standard": standard_model})
    if scenes is not None:
        require("scenes", scenes, Bound(1, 1_000_000, "presses"), "score at least one")
    if recordings and scenes is not None:
        raise InvalidQuantity("scenes", scenes, "left out with recordings", "score one or the other")
    if phantoms and not recordings:
        raise InvalidQuantity("phantoms", phantoms, "beside recordings", "name recordings of these phantoms")
    if calibration and light != "physical":
        raise InvalidQuantity("light", light, "left out with --calibration", "name the certificate or the light")
    named = [name for name, is_asked in zip(REFERENCES, (noise_free, posterior, scan), strict=True) if is_asked]
    if light != "physical" and (named or not (recordings or asked in (None, "paper"))):
        bound = "given with recordings or in mode paper alone"
        raise InvalidQuantity("light", light, bound, "leave it out: other presses are of physical light")
    with workers(scheduler):
        if named:
            if recordings:
                options = ", ".join(f"--{name}" for name in REFERENCES)
                raise InvalidQuantity("recordings", len(recordings), "none", f"leave out {options}")
            if calibration:
                raise InvalidQuantity("calibration", calibration, "none", "leave it out: chapters read no certificate")
            chapters = _reference(named, standard_model, table, asked, scenes=scenes, seed=seed)
            told = _asked(asked, light, {"standard": standard_model}, None, scenes=scenes, seed=seed)
            _show_reference(measure_chapters(chapters), told if as_json else None)
            return
        count = SCENES if scenes is None else scenes
        if recordings:
            samples = _of(recordings, phantoms)
            if phantoms:
                _note_castings(recordings, phantoms, standard_model)
            calibration = calibration or _beside(standard_model, light)
        elif asked is None or asked == "paper":
            certificate = calibration or table / _certificate(light)
            read = None if calibration else light
            told = _asked("paper", read, {"paper": model}, certificate, scenes=count, seed=seed)
            _paper(model, table, light, count, seed, certificate=certificate, told=told if as_json else None)
            return
        else:
            samples = _random_presses(asked, table, count, seed)
        certificate = calibration or table / _certificate(light)
        bundles = {"paper": model, "quick": quick_model, "standard": standard_model}
        drawn = {"scenes": None, "seed": None} if recordings else {"scenes": count, "seed": seed}
        told = _asked(asked, None if calibration else light, bundles, certificate, **drawn)
        _score(bundles, certificate, asked, samples, told if as_json else None)


def _require_named(folders: Mapping[str, Path]) -> None:
    """Raise `InvalidQuantity` for a bundle that is named and not there; only the released ones may be missing."""
    for name, folder in folders.items():
        if folder != MODELS / name and not folder.is_dir():
            action = f"correct --{name}-model, or leave it out for the released one"
            raise InvalidQuantity(f"{name}_model", folder, "a folder with a model bundle", action)


def _asked(
    mode: Mode | None,
    light: str | None,
    models: Mapping[str, Path],
    certificate: Path | None,
    *,
    scenes: int | None,
    seed: int | None,
) -> dict[str, Any]:
    """Return what was asked for as JSON; null is what recordings, chapters or the certificate say themselves."""
    return {
        "mode": mode,
        "light": light,
        "scenes": scenes,
        "seed": seed,
        "models": {name: str(folder) for name, folder in models.items()},
        "certificate": None if certificate is None else str(certificate),
    }


def _reference(
    named: list[str], model: Path, table: Path, mode: Mode | None, *, scenes: int | None, seed: int
) -> dict[str, Callable[[], Chapter]]:
    """Return the chapters of these names, on `scenes` presses or as many as `host_tools modes` takes.

    Raises `InvalidQuantity` for a mode that one of them is not of.
    """
    from device.files.bundle_file import read_ramp_model
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.scores.noise_free import noise_free_chapter
    from host_tools.scores.posterior import posterior_chapter
    from host_tools.scores.scan import scan_chapter

    for name in named:
        if mode not in (None, REFERENCES[name]):
            raise InvalidQuantity("mode", mode, REFERENCES[name], f"leave out --mode: --{name} is of no other")
    trained, tables = read_ramp_model(model), ProbeTables.load(table)
    count: dict[str, int] = {} if scenes is None else {"scenes": scenes}
    presses: dict[str, int] = {} if scenes is None else {"presses": scenes}
    known: dict[str, Callable[[], Chapter]] = {
        "noise-free": lambda: noise_free_chapter(trained.answers, tables, seed=seed, **presses),
        "posterior": lambda: posterior_chapter(trained, seed=seed, **count),
        "scan": lambda: scan_chapter(trained, seed=seed, **count),
    }
    return {name: known[name] for name in named}


def _show_reference(measured: dict[str, Timed], told: dict[str, Any] | None) -> None:
    """Print chapters, as JSON beside what was `told`; exit with code 1 when a figure misses its bound."""
    if told:
        from host_tools.pages.page import chapter_record

        chapters = {name: chapter_record(timed) for name, timed in measured.items()}
        print(json.dumps({"asked": told, "chapters": chapters}))
    else:
        out = Console(width=160, highlight=False)
        for timed in measured.values():
            print_chapter(timed)
            out.print(timed.chapter.claim, markup=False)
            for shown in timed.chapter.tables:
                print_table(shown)
    if not all(timed.chapter.passed for timed in measured.values()):
        raise typer.Exit(1)


def _score(
    bundles: Mapping[str, Path],
    certificate: Path,
    mode: Mode | None,
    samples: Iterator[Sample],
    told: dict[str, Any] | None,
) -> None:
    """Print the score of recordings by bundles of mode paper, quick and standard; as JSON beside what was `told`."""
    from device.files.bundle_file import read_models, read_paper_model
    from device.files.certificate_file import read_calibration
    from device.measurement.mode_models import analysed
    from host_tools.scores.score_recordings import print_score, score, score_record

    models = read_models(read_paper_model(bundles["paper"]), bundles["quick"], bundles["standard"])
    calibration = read_calibration(certificate)
    _require_made_together(models, calibration, mode)
    say = partial(note.print, markup=False, soft_wrap=True)
    answer = partial(analysed, models=models, calibration=calibration, mode=mode)
    scored = score(samples, answer, say, _bound_of(models))
    if told:
        print(json.dumps({"asked": told, **score_record(scored)}))
    else:
        print_score(scored, _screen())


def _require_made_together(models: ModeModels, calibration: Calibration, mode: Mode | None) -> None:
    """Raise `BundleRefused` for bundles that the probe's daemon would refuse beside each other.

    Only bundles that answer in `mode`, None for all, and each probe that they are for, which has no others.
    """
    from device.measurement.ramp_modes.model import RAMP_MODES

    if mode is not None:
        models = models._replace(
            quick=models.quick if mode == "quick" else None, ramp=models.ramp if mode in RAMP_MODES else None
        )
    cards = [model.bundle.card for model in (models.quick, models.ramp) if model]
    for serial in sorted({one for card in cards for one in card.get("serials", [])}):
        models.for_probe(serial).require_made_together(calibration if calibration.serial == serial else None)


def _screen() -> Console:
    return Console(width=110, highlight=False)


def _bound_of(models: ModeModels) -> LeastErrors:
    """Return what bounds the errors of standard and precise; the bundles of the other modes hold no forward model."""
    from host_tools.cramer_rao.press_bound import least_errors
    from host_tools.scores.score_recordings import unbounded

    return partial(least_errors, models.ramp.answers) if models.ramp else unbounded


def _beside(standard_model: Path, light: str) -> Path | None:
    """Return the certificate that `host_tools commission` wrote beside a bundle; None in the light of the paper."""
    certificate = standard_model / CERTIFICATE
    return certificate if light == "physical" and certificate.exists() else None


def _certificate(light: str) -> str:
    if light not in CERTIFICATES:
        raise InvalidQuantity("light", repr(light), f"one of {', '.join(CERTIFICATES)}", "choose one of them")
    return CERTIFICATES[light]


def _paper(
    model: Path, table: Path, light: str, scenes: int, seed: int, *, certificate: Path, told: dict[str, Any] | None
) -> None:
    """Print the scores of mode paper: its nine phantoms, and random scenes; as JSON beside what was `told`."""
    from device.files.bundle_file import read_paper_model
    from device.files.certificate_file import read_calibration
    from device.simulation.scenario import Scenario
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.scores.paper_scores import (
        Rig,
        paper_record,
        phantom_errors,
        print_intervals,
        print_phantoms,
        random_intervals,
    )

    rig = Rig(read_paper_model(model), read_calibration(certificate), ProbeTables.load(table), Scenario(light=light))
    errors = phantom_errors(rig, phantoms_of(rig.bundle), seed=seed)
    intervals = random_intervals(rig, scenes=scenes, seed=seed)
    if told:
        print(json.dumps({"asked": told, **paper_record(errors, intervals)}))
        return
    print_phantoms(errors, _screen())
    print_intervals(intervals, _screen())


def _of(paths: list[Path], phantoms: Path | None) -> Iterator[Sample]:
    """Return recordings with the truth that they carry, or with truth and tissue of the phantoms that they name."""
    from device.files.recording_file import read_recording
    from host_tools.scenes.phantom_set import read_phantoms
    from host_tools.scores.score_recordings import Sample

    if phantoms is None:
        return (Sample(str(path), partial(read_recording, path)) for path in paths)
    stated = read_phantoms(phantoms)
    return (_on_phantom(path, stated) for path in paths)


def _note_castings(paths: list[Path], phantoms: Path, standard_model: Path) -> None:
    """Say how many recordings are of castings that the probe was commissioned on: their truths are in its answers."""
    from device.measurement.bundle import CARD_FILE
    from host_tools.calibration.known_bench import name_of
    from host_tools.scenes.phantom_set import read_phantoms

    card = json.loads((standard_model / CARD_FILE).read_bytes()) if (standard_model / CARD_FILE).is_file() else {}
    commissioned = card.get("commissioned", {})
    if commissioned.get("phantoms") != read_phantoms(phantoms).serial:
        return
    names = {one["name"] for one in commissioned["phantoms_left_out"]}
    if taught := [name_of(path) for path in paths if name_of(path) in names]:
        told = f"{len(taught)} of {len(paths)} recordings are of phantoms that this probe was commissioned on"
        note.print(f"{told} ({', '.join(sorted(set(taught)))}): they say little of others.", soft_wrap=True)


def _on_phantom(path: Path, stated: PhantomSet) -> Sample:
    from device.measurement.parameters import NOMINAL
    from host_tools.calibration.known_bench import name_of, read_on_phantom
    from host_tools.scores.score_recordings import Sample

    tissue = next((one.parameters for one in stated.phantoms if one.name == name_of(path)), {})
    return Sample(str(path), partial(read_on_phantom, path, stated), {**NOMINAL, **tissue})


def _random_presses(mode: Mode, table: Path, scenes: int, seed: int) -> Iterator[Sample]:
    """Yield presses over the trained ranges that no training has seen, with every drift; scans in mode precise."""
    import numpy as np

    from device.measurement.mode import FRAMES
    from device.measurement.parameters import PARAMETERS
    from device.measurement.ramp_modes.noise import ErrorLevels
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.press_models.press_samples import draw_parameters
    from host_tools.press_models.ramp_training import further_offsets_mm
    from host_tools.press_models.recorded_presses import recorded_press
    from host_tools.press_models.seeds import press_seed
    from host_tools.scores.score_recordings import Sample

    tables = ProbeTables.load(table)
    further_mm = further_offsets_mm(scenes if FRAMES[mode].is_scan else 0, np.random.default_rng([seed, 4]))
    for number, parameters in enumerate(draw_parameters(scenes, np.random.default_rng([seed, 3]))):
        places = further_mm[number] if further_mm else ()
        press = partial(recorded_press, tables, parameters, mode, levels=ErrorLevels(), further_mm=places)
        yield Sample(
            f"press {number}",
            partial(press, press_seed(seed, number)),
            dict(zip(PARAMETERS, map(float, parameters), strict=True)),
        )
