"""The models of a probe, and which of them answers a recording in a mode.

Only mode paper always has one. The others answer where their bundle is installed and says that it is for the probe.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

from device.measurement.bundle import ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode, ModeWorth, mode_of
from device.measurement.paper_mode.estimate import estimate_paper
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.model import QuickModel, estimate_quick
from device.measurement.ramp_modes.estimate import advise_scan, estimate_ramp
from device.measurement.ramp_modes.model import RAMP_MODES, RampModel
from device.measurement.ramp_modes.radial_profile import RampReader, press_profiles
from device.measurement.recording.recording import Recording
from device.measurement.scan_advice import ScanAdvice

OwnModel = TypeVar("OwnModel", QuickModel, RampModel)


class ModeModels(NamedTuple):
    """`paper` of mode paper, `quick` of quick, `ramp` of standard and precise, whose ramps `read` reads."""

    paper: ModelBundle
    quick: QuickModel | None = None
    ramp: RampModel | None = None
    read: RampReader = press_profiles

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The modes that have a model."""
        quick: tuple[Mode, ...] = ("quick",) if self.quick else ()
        return (*quick, *(RAMP_MODES if self.ramp else ()), "paper")

    @property
    def expires_at(self) -> str | None:
        """Until when all commissioned models hold (RFC 3339); None where none is one."""
        cards = [model.bundle.card for model in (self.quick, self.ramp) if model]
        return min((card["expires_at"] for card in cards if card.get("expires_at")), default=None)

    @property
    def flat_field_ratio(self) -> float | None:
        """The level of the flat field that the model of force ramps believes in; None without one."""
        return self.ramp.answers.flat_field_ratio if self.ramp else None

    def worth(self, mode: Mode) -> ModeWorth | None:
        """Return what the answers of a mode are worth by its model card, None when that does not say."""
        bundles = {"quick": self.quick and self.quick.bundle, "paper": self.paper}
        bundle = bundles.get(mode, self.ramp and self.ramp.bundle)
        return bundle.worth(mode) if bundle else None

    def for_probe(self, serial: str) -> ModeModels:
        """Return the models that are for one probe."""
        return self._replace(quick=_if_for(serial, self.quick), ramp=_if_for(serial, self.ramp))

    def prove(self) -> None:
        """Run the golden vectors of every model; raise `BundleRefused` when one of them does not hold any more."""
        for model in (self.quick, self.ramp):
            if model:
                model.prove()
        self.paper.prove()

    def estimate(self, recording: Recording, mode: Mode, calibration: Calibration) -> Estimate:
        """Return the estimate of a recording in a mode.

        Raises `InvalidQuantity` for a mode without a model, and as the mode's own estimate does.
        """
        if mode == "quick" and self.quick:
            return estimate_quick(recording, self.quick, calibration)
        if mode in RAMP_MODES and self.ramp:
            return estimate_ramp(recording, mode, self.ramp, calibration, self.read)
        if mode == "paper":
            return estimate_paper(recording, self.paper, calibration)
        raise self._unavailable(mode)

    def advise(self, recording: Recording, calibration: Calibration) -> ScanAdvice:
        """Return what the ramps of a scan tell so far, and where the next one would tell most.

        Raises `InvalidQuantity` without a model of force ramps, and as the estimate of mode precise does.
        """
        if not self.ramp:
            raise self._unavailable("precise")
        return advise_scan(recording, self.ramp, calibration, self.read)

    def _unavailable(self, mode: Mode) -> InvalidQuantity:
        available = ", ".join(self.modes)
        action = "choose one of them, install its model, or commission the probe"
        return InvalidQuantity("mode", mode, f"one of {available}", action)


def mode_of_recording(recording: Recording) -> Mode:
    """Return the mode that reads most of a recording's press frames."""
    return mode_of([frame.force_n for frame in recording.with_role("press")], len(recording.ramps()))


def analysed(recording: Recording, models: ModeModels, calibration: Calibration, mode: Mode | None = None) -> Estimate:
    """Return the estimate of a recording in a mode; by default in the one that reads most of its press frames."""
    return models.estimate(recording, mode or mode_of_recording(recording), calibration)


def _if_for(serial: str, model: OwnModel | None) -> OwnModel | None:
    return model if model and serial in model.bundle.card.get("serials", []) else None
