"""The models of a probe, and which of them answers a recording in a mode.

Only mode paper always has one. The others answer where their bundle is installed and says that it is for the probe.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

from device.measurement.bundle import BundleRefused, ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode, ModeWorth, is_possible, mode_of
from device.measurement.paper_mode.estimate import estimate_paper
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.model import QuickModel, estimate_quick
from device.measurement.ramp_modes.estimate import advise_scan, estimate_ramp
from device.measurement.ramp_modes.model import RAMP_MODES, RampModel
from device.measurement.ramp_modes.radial_profile import RampReader, press_profiles
from device.measurement.recording.recording import Recording
from device.measurement.scan_advice import ScanAdvice

OwnModel = TypeVar("OwnModel", QuickModel, RampModel)
MADE_WITH = "surrogate_sha256", "expires_at"
"""What the card of mode quick has from the ramps' that it was made with."""
OWN_QUICK = "Set quick_model to the bundle that was made with the other one, or take it out of the settings."
OWN_CERTIFICATE = "Set calibration, standard_model and quick_model to what one commissioning made, or commission again."


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

    def require_made_together(self, calibration: Calibration | None) -> None:
        """Raise `BundleRefused` for a quick bundle or a certificate that is not of the ramps' commissioning.

        Each of another holds by itself, and describes the face of then. What a card of an earlier version does not say
        is not compared, nor is when a certificate with lines ends: `host_tools calibrate` makes that.
        """
        if self.ramp and self.quick:
            _require_same(self.quick.bundle, self.ramp.bundle)
        if self.ramp and calibration and not calibration.lines:
            _require_until(calibration, self.ramp.bundle)

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
    """Return the mode that a recording says and its frames can be of; else the one that reads most of them."""
    press, ramps = recording.with_role("press"), len(recording.ramps())
    if recording.mode and is_possible(recording.mode, len(press), ramps):
        return recording.mode
    return mode_of([frame.force_n for frame in press], ramps)


def analysed(recording: Recording, models: ModeModels, calibration: Calibration, mode: Mode | None = None) -> Estimate:
    """Return the estimate of a recording in a mode; by default that of `mode_of_recording`."""
    return models.estimate(recording, mode or mode_of_recording(recording), calibration)


def _if_for(serial: str, model: OwnModel | None) -> OwnModel | None:
    return model if model and serial in model.bundle.card.get("serials", []) else None


def _require_same(quick: ModelBundle, ramps: ModelBundle) -> None:
    for name in MADE_WITH:
        found, own = quick.card.get(name), ramps.card.get(name)
        if None not in (found, own) and found != own:
            bound = f"{own} of {ramps.folder}, with which it was not made"
            raise BundleRefused(quick.folder, name, found, bound, OWN_QUICK)


def _require_until(calibration: Calibration, ramps: ModelBundle) -> None:
    found, expected = ramps.card.get("expires_at"), calibration.validity.expires_at
    if found not in (None, expected):
        bound = f"{expected} of certificate {calibration.id}, with which it was not made"
        raise BundleRefused(ramps.folder, "expires_at", found, bound, OWN_CERTIFICATE)
