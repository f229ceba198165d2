"""What a press leaves behind: its job while it is under way, the recording of its frames, and its answer, all kept.

The record says in which mode the press was taken; the estimate in it, which mode's model answered. An estimate without
numbers is kept too: it says why there are none. The store comes first, then the board: whoever reads that a press has
changed finds it kept. Formats: `device.records.store` and docs/contracts.md.
"""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from device import __version__
from device.config import Config
from device.errors import DeviceError
from device.files.recording_file import FrameEncoder, png_of
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press.picture import tactile_png
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.press.scan import ScanTaken
from device.instrument.status import PressJob, StatusBoard
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.instrument.watch.progress import ProgressBoard
from device.measurement.estimate import Estimate
from device.measurement.mode import FRAMES, Mode
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.recording import CameraSettings, RecordedCell, Recording
from device.measurement.recording.tactile_image import Frame
from device.measurement.scan_advice import ScanAdvice
from device.records.store import ENDED, Store

log = logging.getLogger(__name__)
SAVE_LIGHT_EVERY_S = 10.0
"""So much light may be missing from the hours counter after a power cut, and that of the press under way."""


class PressBook:
    """Keeps one press after the other; the procedure's thread alone writes in it."""

    def __init__(self, board: StatusBoard, store: Store, budget: LightBudget) -> None:
        self._board, self._store, self._budget = board, store, budget

    def note(self, job: PressJob, **changes: Any) -> None:
        """Keep and show what has changed of a press, with the warnings and the light until now."""
        changed = self.changed(job, **changes)
        self._store.save_press(changed.as_record())
        self._board.update(press=changed)

    def changed(self, job: PressJob, **changes: Any) -> PressJob:
        """Return a press with what has changed of it, with the warnings and the light until now."""
        warnings = tuple(warning.as_record() for warning in self._board.now.warnings)
        light_on_s = round(self._budget.press_s, 2)
        return replace(self._board.now.press or job, warnings=warnings, light_on_s=light_on_s, **changes)

    def warn(self, warning: DeviceError | None) -> None:
        """Show what does not end a press; the next `note` keeps it with the press."""
        if warning:
            others = tuple(one for one in self._board.now.warnings if one.code != warning.code)
            self._board.update(warnings=(*others, warning))

    def fail(self, waiting: PressJob | None, end: DeviceError) -> None:
        """End the press that waits, or is under way, so that the next may begin: also when the store is at fault."""
        job = waiting or self._board.now.press
        if job is None or job.state in ENDED:
            return
        light_on_s = 0.0 if waiting else round(self._budget.press_s, 2)
        failed = replace(job, state="failed", reason=str(end), code=end.code, light_on_s=light_on_s)
        self._board.update(press=failed)
        try:
            self._store.save_press(failed.as_record())
        except DeviceError as error:
            log.error("%s %s", error.code, error)

    def save_light_hours(self, *, at_least_s: float = 0.0) -> None:
        """Add the light since the last time to the hours counter, unless it is less than `at_least_s`."""
        seconds = self._budget.unsaved_s
        if seconds >= at_least_s:
            self._store.add_light_on_s(seconds)
            self._budget.note_saved(seconds)


@dataclass(frozen=True)
class PressAnswer:
    """What the frames of a press say: their recording, and the measurement as it will be kept, without a number."""

    recording: Recording
    record: dict[str, Any]
    exam_id: str | None = None

    @property
    def measurement_id(self) -> str:
        """What the measurement will be called."""
        return str(self.record["id"])

    @property
    def shown(self) -> dict[str, Any]:
        """What the screen shows of it before it is kept: nothing by which anybody could ask for it."""
        return {name: self.record[name] for name in ("taken_at", "mode", "estimate", "truth", "ramps", "reached")}


class PressAnswers:
    """Answers one press after the other, each in its mode."""

    def __init__(
        self,
        config: Config,
        calibration: CalibrationWatch,
        answers: ProbeAnswers,
        store: Store,
        progress: ProgressBoard,
        truth: Inclusion | None,
        encode: FrameEncoder = png_of,
    ) -> None:
        """Take the inclusion that a simulated probe presses on as `truth`; `encode` may know PNGs of the frames."""
        self._config, self._calibration, self._truth = config, calibration, truth
        self._answers = answers
        self._store, self._progress, self._encode = store, progress, encode

    @property
    def is_simulated(self) -> bool:
        """Whether what is pressed on is known, as on the simulated probe alone."""
        return self._truth is not None

    def look_ahead(self, beside: Sequence[Frame], mode: Mode, started_at: str) -> None:
        """Read the frames of the press beside the lesion, while the hand goes on to it."""
        if FRAMES[mode].is_ramp:
            self._answers.look_ahead(self._recording(beside, started_at))

    def advise(self, frames: Sequence[Frame], started_at: str) -> ScanAdvice:
        """Return what the frames of a scan tell so far; raises as `answer` does."""
        return self._answers.adviser(self._recording(frames, started_at))

    def answer(
        self,
        frames: Sequence[Frame],
        job: PressJob,
        started_at: str,
        warnings: Sequence[DeviceError],
        scan: ScanTaken | None = None,
    ) -> PressAnswer:
        """Return what a press's frames say, those of a scan what was its last advice; it is kept nowhere yet.

        Raises `InvalidQuantity` when an estimate cannot be made of them.
        """
        recording = replace(self._recording(frames, started_at), mode=job.mode)
        estimate = scan.advice.estimate if scan else self._answers.estimator(recording, job.mode)
        record = measurement_record(recording, estimate, job.mode, warnings)
        asked = {"until": job.until, "within_s": job.within_s, "reached": scan.reached if scan else None}
        return PressAnswer(recording, record | asked, job.exam_id)

    def _recording(self, frames: Sequence[Frame], started_at: str) -> Recording:
        return recording_of(
            frames,
            self._config,
            started_at=started_at,
            calibration_id=self._calibration.id,
            simulated_truth=self._truth,
        )

    def keep(self, answer: PressAnswer, ended: PressJob, on_kept: Callable[[], None] = lambda: None) -> dict[str, Any]:
        """Return the measurement with its number, once it, its recording, its picture and its press are on the disk.

        `on_kept` is called before anybody can ask for it. Raises `StorageError` when it cannot be kept.
        """
        picture = _picture_of(answer.recording)
        with self._progress.inside("storage"):
            return self._store.add_measurement(
                answer.record,
                answer.recording,
                exam_id=answer.exam_id,
                encode=self._encode,
                picture=picture,
                ended=ended.as_record(),
                on_kept=on_kept,
            )


def _picture_of(recording: Recording) -> bytes:
    """Return the picture, or none: what cannot be shown is measured all the same.

    Of a scan it is that of the first press, which has the lesion in the middle.
    """
    try:
        return tactile_png(recording.of_ramp(0))
    except InvalidQuantity as error:
        log.warning("no picture of the recording %s: %s", recording.id, error)
        return b""


def recording_of(
    frames: Sequence[Frame],
    config: Config,
    *,
    started_at: str,
    calibration_id: str | None,
    simulated_truth: Inclusion | None,
) -> Recording:
    """Return a new recording of a probe's frames; a probe whose truth is known is a simulated one."""
    camera = config.camera
    settings = CameraSettings(
        width_px=camera.width_px,
        height_px=camera.height_px,
        bits=8,
        mm_per_px_x=camera.mm_per_px_x,
        mm_per_px_y=camera.mm_per_px_y,
        exposure_us=camera.exposure_us,
        gain=camera.gain,
        axis_x_mm=camera.axis_x_mm,
        axis_y_mm=camera.axis_y_mm,
        rim_distortion_percent=camera.rim_distortion_percent,
    )
    return Recording(
        id=str(uuid.uuid4()),
        serial=config.serial,
        software=__version__,
        started_at=started_at,
        camera=settings,
        frames=tuple(frames),
        calibration_id=calibration_id,
        truth=simulated_truth,
        simulated=simulated_truth is not None,
        cell=RecordedCell(config.cell.sensitivity_counts_per_n, config.cell.commissioned_tare_counts),
    )


def measurement_record(
    recording: Recording, estimate: Estimate, mode: Mode, warnings: Sequence[DeviceError]
) -> dict[str, Any]:
    """Return the JSON object of a new measurement, without its sequence number."""
    press = recording.with_role("press")
    return {
        "id": str(uuid.uuid4()),
        "taken_at": recording.started_at,
        "mode": mode,
        "estimate": estimate.as_record(),
        "features": estimate.features,
        "force_n": sum(frame.force_n for frame in press) / len(press),
        "frames": len(press),
        "ramps": len(recording.ramps()),
        "recording_id": recording.id,
        "serial": recording.serial,
        "software": recording.software,
        "truth": None if recording.truth is None else vars(recording.truth),
        "warnings": [warning.as_record() for warning in warnings],
    }
