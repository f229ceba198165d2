"""Press profiles to the posterior of the unknowns: one ramp or several, by fitting the forward model.

A network says where to begin; the fit says all else, also how badly one round inclusion explains the presses. Whether
it lies in the trained ranges, networks of their own tell. The bundle is a folder: `model.onnx` and `model.json` as
every bundle, `surrogate.npz` and `range.onnx` beside them. Source of the format: docs/contracts.md.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.bundle import BundleRefused, ModelBundle
from device.measurement.feature_definitions import RADIAL_PROFILE_FEATURES, units_of
from device.measurement.mode import Mode
from device.measurement.parameters import HIGH, denormalise, normalise_unknowns
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.ramp_modes.answers import RampAnswer, RampAnswers
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.commissioned.own_probe import OWN_ARRAYS, own_probe_of
from device.measurement.ramp_modes.ellipticity import elongation_deviations
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.radial_profile import COLUMNS, NETWORK_NAMES, SeenPresses, network_rows
from device.measurement.ramp_modes.range_classifier import RangeClassifier
from device.measurement.ramp_modes.surrogate import ARRAYS, OFFSET, ScanSurrogate, surrogate_of

SURROGATE_FILE = "surrogate.npz"
RAMP_UNITS = units_of(NETWORK_NAMES, RADIAL_PROFILE_FEATURES)
"""The features of a network that reads a force ramp, ratios all of them."""
RAMP_MODES: tuple[Mode, ...] = ("standard", "precise")
NOT_TOLD_LOG_ODDS = -100.0


@dataclass(frozen=True, eq=False)
class CriticalValues:
    """Of a mode: above any of these a press is not of one round inclusion inside the trained ranges.

    Held-out presses that are exceed each of them in 1 % of cases.
    """

    misfit_ratio: float
    elongation_deviations: float
    outside_log_odds: float
    tissue_from_middle_ratio: float


SURROGATE_ARRAYS = (
    *(f"near_{name}" for name in ARRAYS),
    *(f"beside_{name}" for name in ARRAYS),
    "to_mm",
    "camera",
    "forward",
)
"""Arrays of the surrogate's file: both polynomials, the largest offset, and the covariances [P, P] of the noise."""


def ramp_answers_of(arrays: Mapping[str, NDArray[Any]]) -> RampAnswers:
    """Return what the arrays in `SURROGATE_ARRAYS` say, and those in `OWN_ARRAYS` where any is there.

    Raises `InvalidQuantity` when one is of another shape, or when a commissioned probe's lack some of its own.
    """
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
    missing = [name for name in OWN_ARRAYS if name not in arrays]
    if len(missing) == len(OWN_ARRAYS):
        return RampAnswers(surrogate, PressNoise(camera, forward=forward))
    if missing:
        raise InvalidQuantity(
            "arrays of a commissioned probe", f"no {', '.join(missing)}", "all", "commission it again"
        )
    own = own_probe_of(arrays)
    return OwnAnswers(surrogate, PressNoise(camera, own.levels, forward), own)


def surrogate_arrays(answers: RampAnswers) -> dict[str, NDArray[Any]]:
    """Return the arrays in `SURROGATE_ARRAYS`, polynomials in single precision, and a commissioned probe's own."""
    near, beside = answers.surrogate.near.arrays(), answers.surrogate.beside.arrays()
    named = {f"near_{name}": part for name, part in near.items()}
    named |= {f"beside_{name}": part for name, part in beside.items()}
    forward = np.zeros((COLUMNS, COLUMNS)) if answers.noise.forward is None else answers.noise.forward
    named |= {"to_mm": np.array(answers.surrogate.to_mm), "camera": answers.noise.camera, "forward": forward}
    return named | (answers.own.arrays() if isinstance(answers, OwnAnswers) else {})


def found_values(
    answer: RampAnswer, seen: SeenPresses, answers: RampAnswers, log_odds: Callable[[Array], Array]
) -> CriticalValues:
    """Return how far presses are from one round inclusion in the ranges.

    Round and inside are told by the press that lies nearest; one that lies beside the inclusion tells neither. A
    commissioned probe fits both components of the offset, each in its range. Up to the corner of these a press tells
    whether the inclusion is round, and so does a scan's: two of them close together are mostly read as one there.
    """
    at, beside = answer.best, denormalise(answer.best)[OFFSET] / HIGH[OFFSET]
    if beside > (sqrt(2) if answer.unlike else 1):
        return CriticalValues(answer.misfit_ratio, 0.0, NOT_TOLD_LOG_ODDS, answer.tissue_from_middle_ratio)
    nearest = slice(answer.nearest, answer.nearest + 1)
    second, rows, unlike = seen.second_harmonics[answer.nearest], seen.rows[nearest], answer.unlike
    if unlike:
        left = np.stack([second[0], second[1] - unlike.second_across.reshape(second[1].shape)])
        elongation = elongation_deviations(left, unlike.row + unlike.shift, answers.noise, unlike.factor)
        odds = float(log_odds(rows - unlike.shift)[0]) if beside <= 1 else NOT_TOLD_LOG_ODDS
        return CriticalValues(answer.misfit_ratio, elongation, odds, answer.tissue_from_middle_ratio)
    (round_row,) = answers.surrogate.rows(at[None], seen.direction_rad[nearest])
    elongation = elongation_deviations(second, round_row, answers.noise)
    odds = float(log_odds(rows)[0])
    return CriticalValues(answer.misfit_ratio, elongation, odds, answer.tissue_from_middle_ratio)


class RampModel:
    """A verified bundle: network, forward model, and what tells the ranges.

    `critical` values are those of each mode.
    """

    def __init__(self, bundle: ModelBundle, answers: RampAnswers, ranges: RangeClassifier) -> None:
        """Raises `BundleRefused` when the card of a bundle that reads `RAMP_UNITS` lacks the values of a mode.

        And where it is of other ranges of the parameters.
        """
        self.bundle, self.answers, self.ranges = bundle, answers, ranges
        bundle.fields.require_known_ranges()
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

    def answer_to(self, seen: SeenPresses) -> RampAnswer:
        """Return what was read of presses with one reference tells."""
        return self.answers.answer_to(seen, self.first_guesses(seen.rows))

    def first_guesses(self, rows: Array) -> Array:
        """Return the network's estimates [n, 3] of the unknowns' coordinates, for rows [n, P].

        It knows the design's own probe: what a commissioned one changes of ordinary presses is taken off before.
        """
        read: Array = network_rows(rows - self.answers.ordinary_shift(rows))
        return normalise_unknowns(self.bundle.estimate(read).estimate)


def _critical_values(entry: Mapping[str, Any]) -> CriticalValues:
    return CriticalValues(*(float(entry[field.name]) for field in fields(CriticalValues)))
