"""The models of a probe, and which of them answers a recording in a mode.

Only mode paper always has one. The others answer where their bundle is installed and says that it is for the probe.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, TypeVar

from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate, estimate_recording
from device.measurement.mode import Mode, mode_of
from device.measurement.paper_mode.inversion import ModelBundle
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.model import HeldModel, estimate_held
from device.measurement.ramp_modes.estimate import estimate_profile
from device.measurement.ramp_modes.model import RAMP_MODES, ProfileModel
from device.measurement.recording.recording import Recording

Model = TypeVar("Model", HeldModel, ProfileModel)


class ModeModels(NamedTuple):
    """`paper` of mode paper, `held` of quick, `profile` of standard and precise."""

    paper: ModelBundle
    held: HeldModel | None = None
    profile: ProfileModel | None = None

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The modes that have a model."""
        quick: tuple[Mode, ...] = ("quick",) if self.held else ()
        return (*quick, *(RAMP_MODES if self.profile else ()), "paper")

    def for_probe(self, serial: str) -> ModeModels:
        """Return the models that are for one probe."""
        return ModeModels(self.paper, _if_for(serial, self.held), _if_for(serial, self.profile))

    def prove(self) -> None:
        """Run the golden vectors of every model; raise `BundleRefused` when one of them does not hold any more."""
        for model in (self.held, self.profile):
            if model:
                model.prove()
        self.paper.prove()

    def estimate(self, recording: Recording, mode: Mode, calibration: Calibration) -> Estimate:
        """Return the estimate of a recording in a mode.

        Raises `InvalidQuantity` for a mode without a model, and as the mode's own estimate does.
        """
        if mode == "quick" and self.held:
            return estimate_held(recording, self.held, calibration)
        if mode in RAMP_MODES and self.profile:
            return estimate_profile(recording, mode, self.profile, calibration)
        if mode == "paper":
            return estimate_recording(recording, self.paper, calibration)
        raise InvalidQuantity(
            "mode", mode, f"one of {', '.join(self.modes)}", "choose one of them, or install its model"
        )


def analysed(recording: Recording, models: ModeModels, calibration: Calibration, mode: Mode | None = None) -> Estimate:
    """Return the estimate of a recording in a mode; by default in the one that reads most of its press frames."""
    of_frames = mode_of([frame.force_n for frame in recording.with_role("press")])
    return models.estimate(recording, mode or of_frames, calibration)


def with_models(paper: ModelBundle, held: Path, profile: Path) -> ModeModels:
    """Return the bundle of mode paper with the models of two folders, which may be missing.

    Raises `BundleRefused` or `InvalidQuantity` when one that is there does not hold.
    """
    return ModeModels(paper, _if_there(held, HeldModel.load), _if_there(profile, ProfileModel.load))


def _if_there(folder: Path, load: Callable[[Path], Model]) -> Model | None:
    return load(folder) if folder.exists() else None


def _if_for(serial: str, model: Model | None) -> Model | None:
    return model if model and serial in model.bundle.card.get("serials", []) else None
