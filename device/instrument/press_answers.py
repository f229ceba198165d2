"""Frames of a press to its answer, kept: the recording of the frames, what the estimator says of it, both in the store.

An estimate without numbers is kept too: it says why there are none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from device.config import Config
from device.errors import DeviceError
from device.instrument.calibration_watch import CalibrationWatch
from device.instrument.press_record import measurement_record, recording_of
from device.instrument.progress import ProgressBoard
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode
from device.measurement.quantities import Inclusion
from device.measurement.recording import Recording
from device.measurement.tactile_image import Frame
from device.records.store import Store

Estimator = Callable[[Recording, Mode], Estimate]


class PressAnswers:
    """Answers one press after the other, each in its mode."""

    def __init__(
        self,
        config: Config,
        calibration: CalibrationWatch,
        estimator: Estimator,
        store: Store,
        progress: ProgressBoard,
        truth: Inclusion | None,
    ) -> None:
        """Take the inclusion that a simulated probe presses on as `truth`."""
        self._config, self._calibration, self._truth = config, calibration, truth
        self._estimator, self._store, self._progress = estimator, store, progress

    @property
    def is_simulated(self) -> bool:
        """Whether what is pressed on is known, as on the simulated probe alone."""
        return self._truth is not None

    def keep(
        self, frames: Sequence[Frame], mode: Mode, started_at: str, warnings: Sequence[DeviceError]
    ) -> dict[str, Any]:
        """Return the measurement that was made of a press's frames, once it and its recording are on the disk.

        Raises `InvalidQuantity` when an estimate cannot be made of them, `StorageError` when it cannot be kept.
        """
        recording = recording_of(
            frames,
            self._config,
            started_at=started_at,
            calibration_id=self._calibration.id,
            simulated_truth=self._truth,
        )
        estimate = self._estimator(recording, mode)
        record = measurement_record(recording, estimate, mode, warnings)
        with self._progress.inside("storage"):
            return self._store.add_measurement(record, recording)
