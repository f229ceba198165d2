"""The models of a probe to its answers: the modes in which it can be pressed, and what estimates a recording of each.

A mode is offered only when its model is there; the mode of the settings must be one of those.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, Protocol, TypeVar

from device.config import Config
from device.errors import ConfigError
from device.instrument.procedure import Estimator
from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate, estimate_recording
from device.measurement.held_estimate import HeldModel, estimate_held
from device.measurement.inversion import ModelBundle
from device.measurement.mode import Mode
from device.measurement.profile_estimate import estimate_profile
from device.measurement.profile_model import RAMP_MODES, ProfileModel
from device.measurement.recording import Recording


class Answers(NamedTuple):
    """The modes in which this probe has a model, and what answers in them."""

    modes: tuple[Mode, ...]
    estimator: Estimator

    def require(self, mode: Mode) -> None:
        """Raise `ConfigError` when the settings ask for a mode that is not among them."""
        if mode not in self.modes:
            cause = f"press.mode is {mode}, but this probe has models for {', '.join(self.modes)} only."
            raise ConfigError(cause, "Choose one of those, or install the model.")


def answers_for(config: Config, bundle: ModelBundle, calibration: Calibration) -> Answers:
    """Return what a probe can answer; raise `ConfigError` when the mode of its settings is not among it.

    Raises `BundleRefused` or `InvalidQuantity` when the model of another mode is there but does not hold.
    """
    held = _for_probe(config, config.quick_model, HeldModel.load)
    profile = _for_probe(config, config.profile_model, ProfileModel.load)

    def estimate(recording: Recording, mode: Mode) -> Estimate:
        if held and mode == "quick":
            return estimate_held(recording, held, calibration)
        if profile and mode in RAMP_MODES:
            return estimate_profile(recording, mode, profile, calibration)
        return estimate_recording(recording, bundle, calibration)

    quick: tuple[Mode, ...] = ("quick",) if held else ()
    answers = Answers((*quick, *(RAMP_MODES if profile else ()), "paper"), estimate)
    answers.require(config.press.mode)
    return answers


class _OfProbes(Protocol):
    """A model that says in its card for which probes it is."""

    @property
    def bundle(self) -> ModelBundle:
        """Its bundle."""


Model = TypeVar("Model", bound=_OfProbes)


def _for_probe(config: Config, folder: Path, load: Callable[[Path], Model]) -> Model | None:
    """Return the model of a folder, or None where there is none for this probe."""
    if not folder.exists():
        return None
    model = load(folder)
    return model if config.serial in model.bundle.card.get("serials", []) else None
