"""Speed and accuracy as one dial: how many frames each mode takes, what it computes, and how far off it is.

The same inclusions, skins and tissues are recorded in the frames of each mode, with every drift; in mode precise as a
scan of two ramps, the fewest that it answers. The dial of a bundle's modes goes into its model card, so that a probe
can say what each mode is worth. Times are the answering thread's, on the machine that measured, which the card names.
"""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.bundle import CARD_FILE, ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.estimate import SPOKEN, Estimate, Quantity
from device.measurement.mode import FRAMES, Mode
from device.measurement.mode_models import ModeModels
from device.measurement.parameters import EVEN_STD, HIGH, LOW
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.surrogate import TISSUE
from device.measurement.recording.recording import Recording
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Chapter, Table, at_most
from host_tools.paper_network.export import write_folder
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.ramp_training import further_offsets_mm
from host_tools.press_models.recorded_presses import recorded_press
from host_tools.press_models.seeds import derived_seed, press_seed
from host_tools.scores.score_recordings import PRIOR_GUESS, percent_error

PRESSES = 48
CALLS, LONGEST_CALL_S = 200, 0.5e-3
GAUSSIAN_90 = 1.645
"""Nine in ten of a Gaussian's values lie within so many standard deviations."""


class TimedAnswers(NamedTuple):
    """One press's truth, modulus of its tissue, answer, and the processor time (s) of the thread that gave it."""

    truth: Inclusion
    tissue_kpa: float
    estimate: Estimate
    seconds: float


def dial_chapter(
    models: ModeModels, network: ModelBundle, calibration: Calibration, tables: ProbeTables, *, seed: int = 1
) -> Chapter:
    """Return error and time of each mode on the same inclusions, and the time of the networks of `network` alone."""
    answer = partial(models.estimate, calibration=calibration)
    seen = {mode: timed_presses(answer, mode, tables, seed=seed) for mode in models.modes}
    header = ("mode", "frames on the lesion", "compute (ms)", "answered", *_columns("error"), *_columns("error, all"),
              *_columns("determined"))  # fmt: skip
    return Chapter(
        title="Speed and accuracy",
        claim=f"{PRESSES} random presses over the trained ranges (10-160 kPa), the same ones in every mode.",
        source="host_tools/scores/dial.py; seconds of a press: `GET /api/v1/device`",
        benchmarks=(at_most("networks of one press", "median time of one call (ms)", *_network_ms(network)),),
        tables=(
            Table("The dial", header, (*(_row(mode, found) for mode, found in seen.items()), _guess(seen["standard"]))),
            Table(
                "The patient's tissue, which the press beside the lesion tells mode precise",
                ("answered", "RMS error", "stated spread", "spread of the range", "truth in 90 %"),
                (_tissue_row(seen["precise"]),),
            ),
        ),
    )


def timed_presses(
    answer: Callable[[Recording, Mode], Estimate],
    mode: Mode,
    tables: ProbeTables,
    *,
    seed: int = 1,
    presses: int | None = None,
) -> list[TimedAnswers]:
    """Return the answers of a mode to recordings of random presses, one after the other; alike for every mode.

    `PRESSES` of them, or as many as asked for. Where the mode is a scan they have as many ramps as it takes at least.
    """
    of_presses = derived_seed(seed, "dial")
    parameters = draw_parameters(presses or PRESSES, np.random.default_rng(of_presses))
    further_mm = _further_mm(mode, len(parameters), derived_seed(seed, "dial, further ramps"))
    timed = []
    for number, at in enumerate(parameters):
        recording = recorded_press(
            tables, at, mode, press_seed(of_presses, number), levels=ErrorLevels(), further_mm=further_mm[number]
        )
        began = time.thread_time()  # another process that has the core does not count
        estimate = answer(recording, mode)
        seconds = time.thread_time() - began
        timed.append(TimedAnswers(Inclusion(*map(float, at[:TISSUE])), float(at[TISSUE]), estimate, seconds))
    return timed


def _further_mm(mode: Mode, presses: int, seed: int) -> list[Array]:
    """Return where the further ramps of each press lie; none in a mode that presses once."""
    further = FRAMES[mode].fewest_ramps - 1
    return [offsets_mm[:further] for offsets_mm in further_offsets_mm(presses, np.random.default_rng(seed))]


def dial_entry(mode: Mode, found: Sequence[TimedAnswers]) -> dict[str, Any]:
    """Return what a mode's model card says of the dial: frames, compute time, and median errors.

    `median_percent` and `determined` are of what is answered, `median_percent_of_all` of all presses: those without
    numbers count as `PRIOR_GUESS`.
    """
    answered = [one for one in found if one.estimate.size_mm.value is not None]
    pairs = {name: [(getattr(one.truth, name), getattr(one.estimate, name)) for one in answered] for name in UNKNOWNS}
    return {
        "presses": len(found),
        "answered": len(answered),
        "frames": FRAMES[mode].count * FRAMES[mode].fewest_ramps,
        "compute_ms": round(1e3 * float(np.median([one.seconds for one in found])), 1),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "median_percent": {name: _median_percent(of_unknown) for name, of_unknown in pairs.items()},
        "median_percent_of_all": {name: round(float(np.median(errors)), 2) for name, errors in _of_all(found).items()},
        "determined": {
            name: round(float(np.mean([quantity.identifiable for _, quantity in of_unknown])), 4)
            for name, of_unknown in pairs.items()
        },
    }


def _of_all(found: Sequence[TimedAnswers]) -> dict[str, Array]:
    return {name: np.array([percent_error(one.truth, one.estimate, name) for one in found]) for name in UNKNOWNS}


def _median_percent(pairs: Sequence[tuple[float, Quantity]]) -> float:
    """Return the median error of pairs of truth and answer."""
    return round(float(np.median([100 * abs((quantity.value or 0.0) / truth - 1) for truth, quantity in pairs])), 2)


def _network_ms(bundle: ModelBundle) -> tuple[float, float]:
    """Return the median time of one call of the exported networks, and its bound."""
    row = np.array(bundle.card["golden"]["features"][:1])
    seconds = []
    for _ in range(CALLS):
        began = time.perf_counter()
        bundle.estimate(row)
        seconds.append(time.perf_counter() - began)
    return 1e3 * float(np.median(seconds)), 1e3 * LONGEST_CALL_S


def _columns(what: str) -> tuple[str, ...]:
    return tuple(f"{SPOKEN[name]} {what}" for name in UNKNOWNS)


def _row(mode: Mode, found: Sequence[TimedAnswers]) -> tuple[str, ...]:
    entry = dial_entry(mode, found)
    errors = (
        f"{percent:.1f} %" for part in ("median_percent", "median_percent_of_all") for percent in entry[part].values()
    )
    known = (f"{share:.0%}" for share in entry["determined"].values())
    answered = f"{entry['answered']} of {entry['presses']}"
    return mode, f"{entry['frames']}", f"{entry['compute_ms']:.0f}", answered, *errors, *known


def _tissue_row(found: Sequence[TimedAnswers]) -> tuple[str, ...]:
    """Return how well the tissue's modulus is told, over itself; its 90 % interval is a Gaussian's of the spread."""
    told = np.array([
        (one.tissue_kpa, *(one.estimate.features[f"tissue_modulus_{what}kpa"] for what in ("", "std_")))
        for one in found
        if "tissue_modulus_kpa" in one.estimate.features
    ])  # fmt: skip
    truth, told_kpa, spread_kpa = told.T
    error, spread = told_kpa / truth - 1, spread_kpa / told_kpa
    inside = np.mean(np.abs(error) < GAUSSIAN_90 * spread)
    of_range = float(np.log(HIGH[TISSUE] / LOW[TISSUE])) / 2 * EVEN_STD
    rms, stated = (float(np.sqrt(np.mean(one**2))) for one in (error, spread))
    return f"{len(told)}", f"{rms:.1%}", f"{stated:.1%}", f"{of_range:.0%}", f"{inside:.0%}"


def _guess(found: Sequence[TimedAnswers]) -> tuple[str, ...]:
    """Return the errors of a guess from the ranges alone."""
    errors = [
        np.median([100 * abs(getattr(PRIOR_GUESS, name) / getattr(one.truth, name) - 1) for one in found])
        for name in UNKNOWNS
    ]
    return ("a guess", "0", "0", "", "", "", "", *(f"{error:.1f} %" for error in errors), "", "", "")


def publish_dial(
    folder: Path, modes: Sequence[Mode], answer: Callable[[Recording, Mode], Estimate], tables: ProbeTables
) -> None:
    """Measure modes of the bundle in a folder, and write what was found to its card; whole or not at all."""
    files = {path.name: path.read_bytes() for path in folder.iterdir()}
    card = json.loads(files[CARD_FILE])
    for mode in modes:
        card["modes"][mode]["dial"] = dial_entry(mode, timed_presses(answer, mode, tables))
    files[CARD_FILE] = (json.dumps(card, indent=1, allow_nan=False) + "\n").encode()
    write_folder(folder, files)
