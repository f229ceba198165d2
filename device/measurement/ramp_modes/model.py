"""Press profiles to the posterior of the unknowns: one ramp or several, by fitting the forward model.

A network says where to begin; the fit says all else, also how badly one round inclusion explains the presses. Whether
it lies in the trained ranges, networks of their own tell. The bundle is a folder: `model.onnx` and `model.json` as
every bundle, `surrogate.npz` and `range.onnx` beside them. Source of the format: docs/contracts.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.bundle import BundleRefused, ModelBundle
from device.measurement.feature_definitions import RADIAL_PROFILE_FEATURES, units_of
from device.measurement.mode import Mode
from device.measurement.parameters import COUNT, HIGH, denormalise, normalise_unknowns, slope_of_normalised
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.ramp_modes.ellipticity import elongation_deviations
from device.measurement.ramp_modes.fit import PressPosterior, best_fits
from device.measurement.ramp_modes.intervals import PressIntervals, intervals_of
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.posterior import PressFit, sample_press
from device.measurement.ramp_modes.radial_profile import COLUMNS, NETWORK_NAMES, SeenPresses, network_rows
from device.measurement.ramp_modes.range_classifier import RangeClassifier
from device.measurement.ramp_modes.scan import scan_starts
from device.measurement.ramp_modes.surrogate import ARRAYS, OFFSET, TISSUE, ScanSurrogate, surrogate_of

SURROGATE_FILE = "surrogate.npz"
RAMP_UNITS = units_of(NETWORK_NAMES, RADIAL_PROFILE_FEATURES)
"""The features of a network that reads a force ramp, ratios all of them."""
RAMP_MODES: tuple[Mode, ...] = ("standard", "precise")
WELL_INSIDE = 0.95
"""A fit is begun no nearer to the ends of the ranges, where it would stick."""
NOT_TOLD_LOG_ODDS = -100.0
NEAR = 1e-6
"""Of several starts only the best is sought to the last digit."""


@dataclass(frozen=True, eq=False)
class RampAnswer:
    """What one ramp or several tell.

    `misfit_ratio`: squared residuals of the best fit, each over its standard deviation, over their number.
    `nearest`: number of the press that lies nearest to the inclusion, and `best` the coordinates [9] of the best fit
    there. `tissue_kpa`: mean and spread of the tissue's modulus, which the press beside the lesion tells.
    """

    fit: PressFit
    intervals: PressIntervals
    misfit_ratio: float
    nearest: int
    best: Array
    tissue_kpa: tuple[float, float]

    @property
    def mean(self) -> Array:
        """Mean of the unknowns' coordinates [3]."""
        return self.fit.mean[:COUNT]

    @property
    def spread(self) -> Array:
        """Standard deviation of the unknowns' coordinates [3]."""
        return self.fit.spread[:COUNT]


@dataclass(frozen=True, eq=False)
class CriticalValues:
    """Of a mode: above any of these a press is not of one round inclusion inside the trained ranges.

    Held-out presses that are exceed each of them in 1.25 % of cases.
    """

    misfit_ratio: float
    elongation_deviations: float
    outside_log_odds: float


class RampAnswers:
    """Forward model and noise: what answers, without any limit on its answers."""

    def __init__(self, surrogate: ScanSurrogate, noise: PressNoise) -> None:
        self.surrogate, self.noise = surrogate, noise

    def reach_mm(self, presses: int) -> float:
        """Return how far off the axis the inclusion may lie: further in a scan, whose presses are displaced."""
        return float(HIGH[OFFSET]) if presses == 1 else self.surrogate.to_mm

    def answer(self, rows: Array, estimates: Array, direction_rad: Array | None = None) -> RampAnswer:
        """Return the answer to presses with one reference, rows [N, P], the inclusion in directions [N] of the image.

        `estimates` [n, 3] are first guesses of the unknowns' coordinates.
        """
        reach_mm = self.reach_mm(len(rows))
        posterior = PressPosterior(rows, self.surrogate, self.noise, reach_mm, direction_rad)
        fit = sample_press(posterior, self._start(posterior, rows, estimates, direction_rad))
        nearest = int(np.argmin(fit.best[OFFSET:]))
        best = np.append(fit.best[:OFFSET], reach_mm / HIGH[OFFSET] * (fit.best[OFFSET + nearest] + 1) - 1)
        values = denormalise(np.append(fit.mean[:OFFSET], 0.0))
        spread = np.append(fit.spread[:OFFSET], 0.0) * slope_of_normalised(values)
        misfit = float(np.mean(posterior.residuals(fit.best) ** 2))
        tissue_kpa = float(values[TISSUE]), float(spread[TISSUE])
        return RampAnswer(fit, intervals_of(fit), misfit, nearest, best, tissue_kpa)

    def _start(self, posterior: PressPosterior, rows: Array, estimates: Array, direction_rad: Array | None) -> Array:
        inside = np.clip(estimates, -WELL_INSIDE, WELL_INSIDE)
        if len(rows) == 1:
            return np.concatenate([inside[0], np.zeros(posterior.dimensions - COUNT)])
        starts = scan_starts(rows, inside, self.surrogate, self.noise, self.reach_mm(len(rows)), direction_rad)
        found = best_fits(posterior, starts, np.ones(posterior.dimensions, dtype=bool), tolerance=NEAR)
        return np.asarray(found[np.argmin(np.sum(posterior.residuals(found) ** 2, axis=1))])


SURROGATE_ARRAYS = (
    *(f"near_{name}" for name in ARRAYS),
    *(f"beside_{name}" for name in ARRAYS),
    "to_mm",
    "camera",
    "forward",
)
"""Arrays of the surrogate's file: both polynomials, the largest offset, and the covariances [P, P] of the noise."""


def ramp_answers_of(arrays: Mapping[str, NDArray[Any]]) -> RampAnswers:
    """Return what the arrays in `SURROGATE_ARRAYS` say; raise `InvalidQuantity` when one is of another shape."""
    near, beside = ({name: arrays[f"{part}_{name}"] for name in ARRAYS} for part in ("near", "beside"))
    end_mm, action = float(HIGH[OFFSET]), "install the model again"
    camera, forward = (np.asarray(arrays[name], np.float64) for name in ("camera", "forward"))
    for name, covariance in (("camera's noise", camera), ("forward model's error", forward)):
        if covariance.shape != (COLUMNS, COLUMNS):
            raise InvalidQuantity(f"shape of the {name}", covariance.shape, str((COLUMNS, COLUMNS)), action)
    if arrays["to_mm"].shape:
        raise InvalidQuantity("shape of the largest offset", arrays["to_mm"].shape, "()", action)
    to_mm = float(arrays["to_mm"])
    require("largest offset", to_mm, Bound(end_mm, np.inf, "mm", low_included=False), action)
    surrogate = ScanSurrogate(surrogate_of(near), surrogate_of(beside, end_mm, to_mm))
    return RampAnswers(surrogate, PressNoise(camera, forward=forward))


def surrogate_arrays(answers: RampAnswers) -> dict[str, NDArray[Any]]:
    """Return the arrays in `SURROGATE_ARRAYS`, polynomials in single precision."""
    near, beside = answers.surrogate.near.arrays(), answers.surrogate.beside.arrays()
    named = {f"near_{name}": part for name, part in near.items()}
    named |= {f"beside_{name}": part for name, part in beside.items()}
    forward = np.zeros((COLUMNS, COLUMNS)) if answers.noise.forward is None else answers.noise.forward
    return named | {"to_mm": np.array(answers.surrogate.to_mm), "camera": answers.noise.camera, "forward": forward}


def found_values(
    answer: RampAnswer, seen: SeenPresses, answers: RampAnswers, log_odds: Callable[[Array], Array]
) -> CriticalValues:
    """Return how far presses are from one round inclusion in the ranges.

    Round and inside are told by the press that lies nearest; one that lies beside the inclusion tells neither.
    """
    at = answer.best
    if denormalise(at)[OFFSET] > HIGH[OFFSET]:
        return CriticalValues(answer.misfit_ratio, 0.0, NOT_TOLD_LOG_ODDS)
    nearest = slice(answer.nearest, answer.nearest + 1)
    (round_row,) = answers.surrogate.rows(at[None], seen.direction_rad[nearest])
    elongation = elongation_deviations(seen.second_harmonics[answer.nearest], round_row, answers.noise)
    return CriticalValues(answer.misfit_ratio, elongation, float(log_odds(seen.rows[nearest])[0]))


class RampModel:
    """A verified bundle: network, forward model, and what tells the ranges.

    `critical` values are those of each mode.
    """

    def __init__(self, bundle: ModelBundle, answers: RampAnswers, ranges: RangeClassifier) -> None:
        """Raises `BundleRefused` when the card of a bundle that reads `RAMP_UNITS` lacks the values of a mode."""
        self.bundle, self.answers, self.ranges = bundle, answers, ranges
        try:
            self.critical = {mode: _critical_values(bundle.card["modes"][mode]) for mode in RAMP_MODES}
        except (KeyError, TypeError, ValueError, InvalidQuantity) as error:
            raise BundleRefused(
                bundle.folder, "modes", f"incomplete ({error})", "critical values of every mode"
            ) from error

    def prove(self) -> None:
        """Run the golden vectors of all its networks; raises `BundleRefused` when one does not hold."""
        self.bundle.prove()
        self.ranges.prove()

    def answer(self, rows: Array, direction_rad: Array | None = None) -> RampAnswer:
        """Return what presses with one reference tell, rows [N, P], the inclusion in directions [N] of the image."""
        return self.answers.answer(rows, self.first_guesses(rows), direction_rad)

    def found(self, answer: RampAnswer, seen: SeenPresses) -> CriticalValues:
        """Return how far presses are from one round inclusion inside the trained ranges; see `found_values`."""
        return found_values(answer, seen, self.answers, self.ranges.log_odds)

    def first_guesses(self, rows: Array) -> Array:
        """Return the network's estimates [n, 3] of the unknowns' coordinates, for rows [n, P]."""
        read: Array = network_rows(rows)
        return normalise_unknowns(self.bundle.estimate(read).estimate)


def _critical_values(entry: Mapping[str, Any]) -> CriticalValues:
    return CriticalValues(*(float(entry[field.name]) for field in fields(CriticalValues)))
