"""Speed and accuracy as one dial: how many frames each mode takes, what it computes, and how far off it is.

The same inclusions, skins and tissues are recorded in the frames of each mode, with every drift. Times are of this
machine.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from device.measurement.calibration import Calibration
from device.measurement.estimate import SPOKEN, Estimate
from device.measurement.inversion import ModelBundle
from device.measurement.mode import FRAMES, Mode
from device.measurement.mode_models import ModeModels
from device.measurement.press_noise import ErrorLevels
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.recording import Recording
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.press_samples import draw_parameters
from host_tools.inverse.recorded_presses import recorded_press
from host_tools.inverse.seeds import derived_seed, press_seed
from host_tools.study.benchmark import Chapter, Table, at_most

PRESSES = 48
CALLS, LONGEST_CALL_S = 200, 0.5e-3


class Timed(NamedTuple):
    """One press's truth, answer, and the time (s) that the answer took."""

    truth: Inclusion
    estimate: Estimate
    seconds: float


def dial_chapter(
    models: ModeModels, network: ModelBundle, calibration: Calibration, tables: ProbeTables, *, seed: int = 1
) -> Chapter:
    """Return error and time of each mode on the same inclusions, and the time of the ensemble `network` alone."""

    answer = partial(models.estimate, calibration=calibration)
    seen = {mode: timed_presses(answer, mode, tables, derived_seed(seed, "dial")) for mode in models.modes}
    header = ("mode", "frames a press", "compute (ms)", "answered", *_columns("error"), *_columns("determined"))
    return Chapter(
        title="Speed and accuracy",
        claim=(
            f"{PRESSES} random presses over the trained ranges (10-160 kPa), the same ones in every mode: median error "
            "of what is answered, and how often the unknown is called determined. The last row guesses the median "
            "of the truths."
        ),
        source="host_tools/study/mode_dial.py; seconds of a press: `GET /api/v1/device`",
        benchmarks=(at_most("ensemble of one press", "median time of one call (ms)", *_network_ms(network)),),
        tables=(Table("The dial", header, (*(_row(mode, found) for mode, found in seen.items()), _guess(seen))),),
    )


def timed_presses(
    answer: Callable[[Recording, Mode], Estimate], mode: Mode, tables: ProbeTables, seed: int
) -> list[Timed]:
    """Return the answers of a mode to recordings of random presses, one after the other."""
    parameters = draw_parameters(PRESSES, np.random.default_rng(seed))
    timed = []
    for number, at in enumerate(parameters):
        recording = recorded_press(tables, at, mode, press_seed(seed, number), levels=ErrorLevels())
        began = time.perf_counter()
        estimate = answer(recording, mode)
        timed.append(Timed(Inclusion(*map(float, at[:3])), estimate, time.perf_counter() - began))
    return timed


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


def _row(mode: Mode, found: Sequence[Timed]) -> tuple[str, ...]:
    answered = [one for one in found if one.estimate.size_mm.value is not None]
    errors, known = [], []
    for name in UNKNOWNS:
        pairs = [(getattr(one.truth, name), getattr(one.estimate, name)) for one in answered]
        errors.append(f"{np.median([100 * abs(quantity.value / truth - 1) for truth, quantity in pairs]):.1f} %")
        known.append(f"{np.mean([quantity.identifiable for _, quantity in pairs]):.0%}")
    milliseconds = f"{1e3 * np.median([one.seconds for one in found]):.0f}"
    return mode, f"{FRAMES[mode].count}", milliseconds, f"{len(answered)} of {len(found)}", *errors, *known


def _guess(seen: dict[Mode, list[Timed]]) -> tuple[str, ...]:
    truths = np.array([one.truth.as_tuple() for one in seen["standard"]])
    errors = np.median(100 * np.abs(np.median(truths, axis=0) / truths - 1), axis=0)
    return ("a guess", "0", "0", "", *(f"{error:.1f} %" for error in errors), "", "", "")
