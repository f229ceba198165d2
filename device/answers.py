"""The models of a probe to its answers: the modes in which it can be pressed, and what estimates a recording of each.

A mode is offered only when its model is there; the mode of the settings must be one of those.
"""

from __future__ import annotations

from typing import NamedTuple

from device.config import Config
from device.errors import ConfigError, MissingCalibration
from device.instrument.procedure import Estimator
from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate
from device.measurement.inversion import ModelBundle
from device.measurement.mode import Mode
from device.measurement.mode_models import with_models
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


def answers_for(config: Config, bundle: ModelBundle, calibration: Calibration | None) -> Answers:
    """Return what a probe can answer; without a calibration its estimator raises `MissingCalibration`.

    Raises `BundleRefused` or `InvalidQuantity` when the model of another mode is there but does not hold.
    """
    models = with_models(bundle, config.quick_model, config.profile_model).for_probe(config.serial)

    def estimate(recording: Recording, mode: Mode) -> Estimate:
        if calibration is None:
            raise MissingCalibration("The probe is not calibrated.", "Calibrate it and activate the certificate.")
        return models.estimate(recording, mode, calibration)

    return Answers(models.modes, estimate)
