"""A press profile to mean and spread of the unknowns: standard by networks, precise by fitting the forward model.

Either way the best fit of the forward model is sought, because how badly it fits is what tells that a press is not of
one round inclusion, and whose second harmonic a round one has; whether it lies in the trained ranges, networks of
their own tell. The bundle is a folder:
`model.onnx` and `model.json` as every bundle, `surrogate.npz`, `range.onnx` and `round.npz` beside them.
Source of the format: docs/contracts.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.bundle import BundleRefused, ModelBundle
from device.measurement.confidence_belt import belts_of
from device.measurement.feature_definitions import RADIAL_PROFILE_FEATURES, units_of
from device.measurement.mode import Mode
from device.measurement.parameters import NUISANCES, denormalise, normalise_unknowns, slope_of_normalised
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.ramp_modes.ellipticity import EllipticityTest
from device.measurement.ramp_modes.fit import PressPosterior, best_fit
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.posterior import sample_press
from device.measurement.ramp_modes.radial_profile import ROW_NAMES
from device.measurement.ramp_modes.range_classifier import RangeClassifier
from device.measurement.ramp_modes.surrogate import TISSUE, PressSurrogate

SURROGATE_FILE = "surrogate.npz"
RAMP_UNITS = units_of(ROW_NAMES, RADIAL_PROFILE_FEATURES)
"""The features of a network that reads a force ramp: the whole row of the press profile, ratios all of them."""
RAMP_MODES: tuple[Mode, ...] = ("standard", "precise")
WELL_INSIDE = 0.95
"""A fit is begun no nearer to the ends of the ranges, where it would stick."""


class RampAnswer(NamedTuple):
    """Mean and spread [3] of the unknowns' coordinates, and how well one inclusion explains the press.

    `misfit_ratio`: squared residuals of the best fit, each over its standard deviation, over their number.
    `best`: coordinates [9] of the best fit.
    `tissue_kpa`: mean and spread of the tissue's modulus, which the press beside the lesion tells; precise only.
    """

    mean: Array
    spread: Array
    misfit_ratio: float
    best: Array
    tissue_kpa: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class CriticalValues:
    """Of a mode: above any of these a press is not of one round inclusion inside the trained ranges.

    Held-out presses that are exceed each of them in 1.25 % of cases.
    """

    misfit_ratio: float
    elongation_deviations: float
    outside_log_odds: float


class RampAnswers:
    """Networks, surrogate and noise of each mode: what answers, without any limit on its answers."""

    def __init__(self, surrogate: PressSurrogate, noise: Mapping[Mode, PressNoise]) -> None:
        self.surrogate, self.noise = surrogate, noise

    def answer(self, row: Array, mode: Mode, mean: Array, spread: Array) -> RampAnswer:
        """Return the answer to a profile row [P] for which the networks say `mean` and `spread` [3]."""
        posterior = PressPosterior(row, self.surrogate, self.noise[mode])
        start = np.concatenate([np.clip(mean, -WELL_INSIDE, WELL_INSIDE), np.zeros(len(NUISANCES))])
        if mode != "precise":
            return _answer(posterior, best_fit(posterior, start), mean, spread)
        fit = sample_press(posterior, start)
        values = denormalise(fit.mean)
        tissue_kpa = float(values[TISSUE]), float((fit.spread * slope_of_normalised(values))[TISSUE])
        unknowns = slice(len(UNKNOWNS))
        return _answer(posterior, fit.best, fit.mean[unknowns], fit.spread[unknowns])._replace(tissue_kpa=tissue_kpa)


def _answer(posterior: PressPosterior, best: Array, mean: Array, spread: Array) -> RampAnswer:
    residuals = posterior.residuals(best)
    return RampAnswer(mean, spread, float(np.mean(residuals**2)), best)


class RampModel:
    """A verified bundle: networks, forward model, what tells the ranges and what is round.

    `belts` and `critical` values are those of each mode.
    """

    def __init__(
        self, bundle: ModelBundle, answers: RampAnswers, ranges: RangeClassifier, ellipticity: EllipticityTest
    ) -> None:
        """Raises `BundleRefused` when the card of a bundle that reads `RAMP_UNITS` lacks the values of a mode."""
        self.bundle, self.answers, self.ranges, self.ellipticity = bundle, answers, ranges, ellipticity
        try:
            entries = {mode: bundle.card["modes"][mode] for mode in RAMP_MODES}
            self.belts = {mode: belts_of(entry) for mode, entry in entries.items()}
            self.critical = {mode: _critical_values(entry) for mode, entry in entries.items()}
        except (KeyError, TypeError, ValueError, InvalidQuantity) as error:
            raise BundleRefused(
                bundle.folder, "modes", f"incomplete ({error})", "belts and critical values of every mode"
            ) from error

    def prove(self) -> None:
        """Run the golden vectors of all its networks; raises `BundleRefused` when one does not hold."""
        self.bundle.prove()
        self.ranges.prove()

    def answer(self, row: Array, mode: Mode) -> RampAnswer:
        """Return what mode standard or precise makes of a profile row [P]."""
        mean, spread = self.networks(row[None])
        return self.answers.answer(row, mode, mean[0], spread[0])

    def networks(self, rows: Array) -> tuple[Array, Array]:
        """Return the networks' mean and spread [n, 3] of the unknowns' coordinates, for rows [n, P]."""
        raw = self.bundle.estimate(rows)
        return normalise_unknowns(raw.estimate), raw.spread


def _critical_values(entry: Mapping[str, Any]) -> CriticalValues:
    return CriticalValues(*(float(entry[field.name]) for field in fields(CriticalValues)))
