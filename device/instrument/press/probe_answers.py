"""What a probe can answer: its modes, and what estimates, advises, looks ahead and proves itself in them.

The models stand behind these functions: the procedure knows none of them, and a test puts in its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from device.errors import ConfigError
from device.instrument.watch.progress import ProgressBoard
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode, ModeWorth
from device.measurement.recording.recording import Recording
from device.measurement.scan_advice import ScanAdvice

PREFERRED: tuple[Mode, ...] = ("standard", "quick", "paper")
"""What a press is taken in that nobody asks another mode for; a scan is always asked for."""
Estimator = Callable[[Recording, Mode], Estimate]
Adviser = Callable[[Recording], ScanAdvice]
LookAhead = Callable[[Recording], None]
"""What reads dark and reference frames of a ramp before there is one on the lesion, so that its answer comes sooner."""


def look_at_nothing(recording: Recording) -> None:
    """Stand for models that have nothing to look at before the press on the lesion."""


def _nothing_to_prove() -> None:
    """Stand for models without golden vectors."""


class ProbeAnswers(NamedTuple):
    """The modes in which this probe has a model, what answers in them, what advises on a scan, what proves that both
    still do, what each mode's answers are worth by its model card, what reads a reference press before them, until when
    a commissioned model holds, and which level of the flat field the models of ramps believe in."""

    modes: tuple[Mode, ...]
    estimator: Estimator
    adviser: Adviser
    prove: Callable[[], None] = _nothing_to_prove
    worth: Mapping[Mode, ModeWorth | None] = MappingProxyType({})
    look_ahead: LookAhead = look_at_nothing
    expires_at: str | None = None
    flat_field_ratio: float | None = None

    def mode_unless_asked(self, stated: Mode | None) -> Mode:
        """Return the mode of a press that is asked for without one: that of the settings, or the best there is.

        Raises `ConfigError` when the settings state one that is not among them, or there is none at all.
        """
        if stated is None:
            offered = [mode for mode in PREFERRED if mode in self.modes]
            if not offered:
                cause = "No model is for this probe."
                raise ConfigError(cause, "Install one for its serial number, or calibrate it for mode paper.")
            return offered[0]
        if stated not in self.modes:
            cause = f"press.mode is {stated}, but this probe has models for {', '.join(self.modes)} only."
            raise ConfigError(cause, "Set press.mode to one of those, or install the model.")
        return stated

    def watched(self, progress: ProgressBoard, begin: Callable[[], None]) -> ProbeAnswers:
        """Return the same, each run of it noted as progress of the inference; `begin` is called before each."""

        def estimator(recording: Recording, mode: Mode) -> Estimate:
            with progress.inside("inference"):
                begin()
                return self.estimator(recording, mode)

        def adviser(recording: Recording) -> ScanAdvice:
            with progress.inside("inference"):
                begin()
                return self.adviser(recording)

        def prove() -> None:
            with progress.inside("inference"):
                begin()
                self.prove()

        return self._replace(estimator=estimator, adviser=adviser, prove=prove)
