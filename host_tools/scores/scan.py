"""What each further ramp of a scan tells: the same inclusions pressed once, twice, three and four times.

Scans are drawn from the forward model and its noise. A hand puts the first ramp up to 2 mm off the axis and further
ones where mode precise asks for them, give or take a millimetre. Beside the share of moduli that are determined stands
the share that the Cramer-Rao bound at the truth would call so: hardly more can be asked for. That bound takes the range
of the modulus as a Gaussian (`host_tools/cramer_rao/information.py`); the best estimate knows where the range ends, too
(`bound_in_box`), and its errors of size and depth stand beside those found.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from device.measurement.arrays import Array
from device.measurement.confidence_belt import IDENTIFIABLE_RATIO
from device.measurement.parameters import (
    COUNT,
    EVEN_STD,
    HIGH,
    LOW,
    NEAR_NOMINAL,
    RANGES,
    Range,
    box_of,
    denormalise_unknowns,
    normalise,
)
from device.measurement.quantities import Bound, require
from device.measurement.ramp_modes.answers import RampAnswer
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.model import RampModel
from device.measurement.ramp_modes.surrogate import DEPTH, MODULUS, OFFSET, SIZE
from host_tools.cramer_rao.information import cramer_rao
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least, at_most
from host_tools.press_models.mode_outcome import EvaluatedPresses, evaluated
from host_tools.press_models.noisy_presses import random_scan
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.ramp_training import further_offsets_mm
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed

UNTOLD = 1e-6
"""Precision of what is known of the modulus where nothing is: its covariance stays finite."""
SCENES, MOST_RAMPS = 160, 4
"""So many tell a share of 60 % to 4 %."""
DETERMINED_AT_LEAST, MEDIAN_PERCENT_AT_MOST = {2: 0.60, 4: 0.75}, {2: 25.0, 4: 18.0}
RMSE_RATIO = 0.6
"""Errors of size and depth over those of one press on the axis."""
CENTRED = "1, on the axis"
BOXES: dict[str, dict[str, Range]] = {"": RANGES, ", tissue near nominal": NEAR_NOMINAL}
"""Ranges that inclusions are drawn from, as the name of a case ends. The targets were set for the second one's."""
HEADER = ("ramps", "E determined", "by the bound", "with the box's ends", "median error of E (%)",
          "RMSE of size (mm)", "its bound (mm)", "RMSE of depth (mm)", "its bound (mm) ",
          "size over one on the axis", "by the bounds", "depth over it", "by the bounds ",
          "size holds", "depth holds", "E holds", "processor time (ms)")  # fmt: skip
MODULI = np.linspace(-1.0, 1.0, 401)
"""Coordinates of the modulus over which what is known of it is summed."""
CHANCES = norm.ppf((np.arange(101) + 0.5) / 101)
"""Equally likely deviations of what is seen of the modulus."""


class BoundInBox(NamedTuple):
    """The least root mean square errors [3] of coordinates, and how likely the modulus is called determined."""

    rms: Array
    determined: float


class AnsweredScan(NamedTuple):
    """The answer to a scan, the processor's time it took, and bounds at the truth.

    `least_spread` [3]: the Cramer-Rao bound with the ranges as Gaussian prior; `in_box`: with the box's ends.
    """

    answer: RampAnswer
    cpu_s: float
    least_spread: Array
    in_box: BoundInBox


class ScansOfLength(NamedTuple):
    """What scans of so many ramps are answered: see `AnsweredScan`.

    `least_spread` and `least_rms` are [n, 3]; `determined_in_box` [n].
    """

    presses: EvaluatedPresses
    cpu_s: Array
    least_spread: Array
    least_rms: Array
    determined_in_box: Array

    @property
    def determined(self) -> float:
        """Share of scans that determine the modulus."""
        return float(self.presses.is_known[:, MODULUS].mean())

    @property
    def determinable(self) -> float:
        """Share of scans of which the bound would say so."""
        return float(np.mean(self.least_spread[:, MODULUS] < IDENTIFIABLE_RATIO * EVEN_STD))

    @property
    def median_percent(self) -> float:
        """Median error of the modulus where it is determined; NaN where it never is."""
        known = self.presses.is_known[:, MODULUS]
        found, truth = (denormalise_unknowns(part)[known, MODULUS] for part in (self.presses.mean, self.presses.truth))
        return float(100 * np.median(np.abs(found / truth - 1))) if known.any() else float("nan")

    @property
    def rmse(self) -> Array:
        """Root mean square errors [3] in the unknowns' own units, determined or not."""
        error = denormalise_unknowns(self.presses.mean) - denormalise_unknowns(self.presses.truth)
        return np.asarray(np.sqrt(np.mean(error**2, axis=0)))

    @property
    def least_rmse(self) -> Array:
        """The least that `rmse` of size and depth [2] can be, in mm."""
        half_range_mm = (HIGH - LOW)[:MODULUS] / 2
        return np.asarray(half_range_mm * np.sqrt(np.mean(self.least_rms[:, :MODULUS] ** 2, axis=0)))

    def held(self, unknown: int) -> str:
        """Return how often the interval of an unknown holds the truth where it is determined."""
        known = self.presses.is_known[:, unknown]
        return f"{self.presses.is_covered[known, unknown].mean():.0%}" if known.any() else "-"


def scan_chapter(model: RampModel, *, seed: int = 1, scenes: int = SCENES, jobs: int = -1) -> Chapter:
    """Return what scans of one to four ramps tell of the same inclusions, beside one press on the axis."""
    require("scenes", scenes, Bound(2, np.inf, "scans"), "ask for more")
    of_scans = derived_seed(seed, "scans by their ramps")
    found = {
        name: answered_scans(model, seed=of_scans, scenes=scenes, ranges=ranges, jobs=jobs)
        for name, ranges in BOXES.items()
    }
    return Chapter(
        title="What each further ramp of a scan tells",
        claim=(
            f"{scenes} random inclusions over the trained ranges, the same ones for every number of ramps, drawn from "
            "the forward model with camera noise, every drift and every nuisance."
        ),
        source="host_tools/scores/scan.py; device/measurement/ramp_modes/scan.py",
        benchmarks=tuple(
            one
            for name, (centred, *by_ramps) in found.items()
            for n in DETERMINED_AT_LEAST
            for one in _benchmarks(f"scan of {n}{name}", n, by_ramps[n - 1], centred.rmse)
        ),
        tables=tuple(Table(f"By the number of ramps{name}", HEADER, _rows(of_box)) for name, of_box in found.items()),
    )


def answered_scans(
    model: RampModel, *, seed: int, scenes: int, ranges: dict[str, Range] = RANGES, jobs: int = -1
) -> list[ScansOfLength]:
    """Return answers to one press on the axis, then to scans of one to `MOST_RAMPS` ramps on the same inclusions.

    These are drawn from `ranges`, which bounds know and answers do not.
    """
    rng = np.random.default_rng(seed)
    truth, (_, half) = normalise(draw_parameters(scenes, rng, ranges=ranges)), box_of(ranges)
    further = [further_offsets_mm(MOST_RAMPS, rng)[MOST_RAMPS - 1][: MOST_RAMPS - 1] for _ in range(scenes)]

    def one(number: int) -> list[AnsweredScan]:
        first_mm = float(HIGH[OFFSET]) * (truth[number, OFFSET] + 1) / 2
        rng = np.random.default_rng([seed, number])
        return [
            *answers_by_ramps(model, truth[number], np.zeros(1), rng, half),
            *answers_by_ramps(model, truth[number], np.append(first_mm, further[number]), rng, half),
        ]

    each = in_parallel(one, scenes, jobs)
    return [_of_length(truth[:, :COUNT], of_length) for of_length in zip(*each, strict=True)]


def answers_by_ramps(
    model: RampModel, truth: Array, offsets_mm: Array, rng: np.random.Generator, half: Array
) -> list[AnsweredScan]:
    """Return the answers to the first ramp, the first two and so on, of one scan of coordinates [9] at offsets [N].

    `half` [9]: half of the ranges that bounds know, in coordinates.
    """
    answers = model.answers
    rows, direction_rad = random_scan(answers.surrogate, answers.noise, truth, offsets_mm, rng)
    found = []
    for count in range(1, len(rows) + 1):
        began = time.process_time()
        answer = model.answer(rows[:count], direction_rad[:count])
        takes = time.process_time() - began
        jacobian = _jacobian(model, rows[:count], direction_rad[:count], truth, offsets_mm[:count])
        of_ranges = EVEN_STD * np.append(half[:OFFSET], np.ones(count))
        least_spread = cramer_rao(jacobian, np.eye(len(jacobian)), of_ranges).std[:COUNT]
        in_box = bound_in_box(jacobian, float(truth[MODULUS]), of_ranges)
        found.append(AnsweredScan(answer, takes, least_spread, in_box))
    return found


def _jacobian(model: RampModel, rows: Array, direction_rad: Array, truth: Array, offsets_mm: Array) -> Array:
    """Return the derivatives [S, 8 + N] of whitened residuals at the truth."""
    reach_mm = model.answers.reach_mm(len(rows))
    at = np.append(truth[:OFFSET], 2 * offsets_mm / reach_mm - 1)
    posterior = PressPosterior(rows, model.answers.surrogate, model.answers.noise, reach_mm, direction_rad)
    (jacobian,) = posterior.residuals_and_jacobian(at[None])[1]
    return np.asarray(jacobian)


def bound_in_box(jacobian: Array, modulus: float, of_ranges: Array) -> BoundInBox:
    """Return the bound of a linear press with whitened derivatives [S, k], which knows where the modulus' range ends.

    `of_ranges` [k]: standard deviations of coordinates in their ranges; the modulus has its whole range.
    What is seen of the modulus strays about its true coordinate as the Cramer-Rao bound without its range says; what is
    left of it then ends with the range. Size and depth are Gaussian given the modulus, with their ranges as prior: what
    is left of the modulus is carried to them along the line on which they hang on it. Mean squares are those of the
    best estimate, the mean of the posterior: over truths that are even in the ranges none errs less. Truths that are
    not possible are not drawn, which leaves a little more to know. Source: Kay (1993), section 10.
    """
    prior = of_ranges**-2.0
    prior[MODULUS] = UNTOLD
    covariance = np.linalg.inv(jacobian.T @ jacobian + np.diag(prior))
    variance = covariance[MODULUS, MODULUS]
    seen = modulus + np.sqrt(variance) * CHANCES
    log_left = -((MODULI - seen[:, None]) ** 2) / (2 * variance)
    left = np.exp(log_left - log_left.max(axis=1, keepdims=True))
    left /= left.sum(axis=1, keepdims=True)
    mean = left @ MODULI
    in_box = left @ MODULI**2 - mean**2
    slope = covariance[:COUNT, MODULUS] / variance
    squares = np.diag(covariance)[:COUNT] - slope**2 * (variance - in_box.mean())
    return BoundInBox(np.sqrt(squares), float(np.mean(np.sqrt(in_box) < IDENTIFIABLE_RATIO * EVEN_STD)))


def _of_length(truth: Array, found: Sequence[AnsweredScan]) -> ScansOfLength:
    answers, cpu_s, least, in_box = zip(*found, strict=True)
    rms, determined = zip(*in_box, strict=True)
    times_s, spreads = np.array(cpu_s), np.array(least)
    return ScansOfLength(evaluated(truth, answers), times_s, spreads, np.array(rms), np.array(determined))


def _benchmarks(case: str, ramps: int, found: ScansOfLength, centred: Array) -> list[Benchmark]:
    over = found.rmse / centred
    return [
        at_least(case, "share that determines E", found.determined, DETERMINED_AT_LEAST[ramps]),
        at_most(case, "median error of E where determined (%)", found.median_percent, MEDIAN_PERCENT_AT_MOST[ramps]),
        at_most(case, "RMSE of size over one press on the axis", float(over[SIZE]), RMSE_RATIO),
        at_most(case, "RMSE of depth over one press on the axis", float(over[DEPTH]), RMSE_RATIO),
    ]


def _rows(of_box: Sequence[ScansOfLength]) -> tuple[tuple[str, ...], ...]:
    centred, *by_ramps = of_box
    further = (_row(f"{n}", one, centred) for n, one in enumerate(by_ramps, start=1))
    return (_row(CENTRED, centred, centred), *further)


def _row(name: str, found: ScansOfLength, centred: ScansOfLength) -> tuple[str, ...]:
    rmse, least = found.rmse[:MODULUS], found.least_rmse
    in_mm, over = (
        np.column_stack([rmse, least]),
        np.column_stack([rmse / centred.rmse[:MODULUS], least / centred.least_rmse]),
    )
    return (
        name, f"{found.determined:.0%}", f"{found.determinable:.0%}", f"{found.determined_in_box.mean():.0%}",
        f"{found.median_percent:.1f}", *(f"{one:.2f}" for one in (*in_mm.ravel(), *over.ravel())),
        *(found.held(unknown) for unknown in range(COUNT)), f"{1e3 * np.median(found.cpu_s):.0f}",
    )  # fmt: skip
