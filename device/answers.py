"""The models of a probe to its answers: the modes in which it can be pressed, and what estimates a recording of each.

A mode is offered only when its model is there; the mode of the settings must be one of those.
"""

from __future__ import annotations

from typing import NamedTuple

from device.config import Config
from device.errors import ConfigError
from device.instrument.procedure import Estimator
from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate, estimate_recording
from device.measurement.inversion import ModelBundle
from device.measurement.mode import Mode
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
    """Return what a probe can answer; raise `ConfigError` when the mode of its settings is not among it."""

    def estimate(recording: Recording, mode: Mode) -> Estimate:
        return estimate_recording(recording, bundle, calibration)

    answers = Answers(("paper",), estimate)
    answers.require(config.press.mode)
    return answers
