"""A scan: press after press on the lesion, each at another place, until it is as sure as was asked for.

After each of them an adviser says what all tell so far, and where the next would tell most. Presses that are complete
are never lost: whatever ends the scan after its first one, but a cancel, leaves an answer from those that are there.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from device.errors import DeviceError, NoContrastError
from device.instrument.press.capture import Capture, PressEnded, RampGivenUp
from device.instrument.press.states import Guidance
from device.instrument.status import PressJob, ScanProgress, StatusBoard
from device.measurement.mode import FRAMES
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.tactile_image import Frame
from device.measurement.scan_advice import ScanAdvice

log = logging.getLogger(__name__)

MAX_FAILED = 3
"""So many presses in a row may fail before the scan ends with those that are complete."""
USUAL_OFFSET_MM = 4.0
"""How far aside the second press goes when the first one tells nothing about where."""


@dataclass(frozen=True)
class ScanTaken:
    """What a scan took: the frames of its complete presses on the lesion, and what they tell.

    `reached`: whether it is as sure as was asked for, None when nothing was asked. `idle_s`: for how long it was waited
    for a further press after that was known. `fault`: what ended it, if that was a fault of the probe.
    """

    frames: list[Frame]
    advice: ScanAdvice
    reached: bool | None
    idle_s: float
    fault: DeviceError | None


class Scan:
    """Leads the hand through the presses of one scan, once the one beside the lesion is done."""

    def __init__(
        self,
        job: PressJob,
        capture: Capture,
        board: StatusBoard,
        *,
        advise: Callable[[Sequence[Frame]], ScanAdvice],
        darken: Callable[[], None],
        note: Callable[[int], None],
    ) -> None:
        """Take what advises on press frames, what darkens the probe, and what is told how many presses are complete."""
        self._job, self._capture, self._board = job, capture, board
        self._advise, self._darken, self._note = advise, darken, note
        self._frames: list[Frame] = []
        self._ramps = self._failed = 0
        self._until_s = math.inf
        self._advised: tuple[ScanAdvice, float] | None = None  # what all frames tell, and since when (s)

    def lead(self) -> ScanTaken:
        """Return what the scan took; ends with the hand lifting, in the dark.

        Raises as `Capture.loaded` and the adviser do as long as no press is complete, and `PressEnded` when it is
        cancelled or the daemon stops.
        """
        fault = None
        try:
            self._press()
            self._press_on()
        except DeviceError as error:
            if self._advised is None:
                raise
            fault = error
        assert self._advised  # a press that is complete has advice, and one that is not has raised
        self._capture.drop_ramp()
        advice, advised_s = self._advised
        reached = self._job.wanted.is_reached(advice.half_width)
        return ScanTaken(self._frames, advice, reached, time.monotonic() - advised_s, fault)

    def _press_on(self) -> None:
        """Lead through further presses, as many as it takes; raises the fault of the probe that ends them."""
        while not self._is_over():
            try:
                with self._capture.unless(self._is_enough):
                    self._capture.lifted()
                    self._press()
            except RampGivenUp:
                return
            except (PressEnded, NoContrastError, InvalidQuantity) as end:
                if not self._tries_again(end):
                    return

    def _press(self) -> None:
        """Take one more press, and what all tell; what the adviser refuses is no press."""
        frames = self._capture.loaded("press", self._job.mode, self._ramps)
        if not self._frames and self._job.within_s is not None:
            self._until_s = (self._capture.machine.touched_s or frames[0].t_s) + self._job.within_s
        self._capture.release()
        self._board.update(guidance=Guidance.LIFT)
        self._darken()
        advice = self._advise([*self._frames, *frames])
        self._frames, self._advised = [*self._frames, *frames], (advice, time.monotonic())
        self._ramps, self._failed = self._ramps + 1, 0
        self._tell()
        self._note(self._ramps)

    def _tell(self, failed: str = "") -> None:
        assert self._advised
        advice, _ = self._advised
        offset_mm = USUAL_OFFSET_MM if advice.next_offset_mm is None else advice.next_offset_mm
        self._board.update(scan=ScanProgress(self._ramps, FRAMES[self._job.mode].most_ramps, advice, offset_mm, failed))

    def _is_over(self) -> bool:
        """Return whether no further press is to come."""
        assert self._advised
        advice, _ = self._advised
        of_mode = FRAMES[self._job.mode]
        if self._is_enough(False) or self._job.wanted.is_reached(advice.half_width):
            return True
        tells_no_more = advice.next_offset_mm is None and self._ramps >= of_mode.fewest_ramps
        return tells_no_more or self._ramps >= of_mode.most_ramps

    def _is_enough(self, is_touching: bool) -> bool:
        """Return whether the operator says so, or the time is over; a press that is under way is finished then."""
        return self._capture.finished.is_set() or (not is_touching and time.monotonic() >= self._until_s)

    def _tries_again(self, end: Exception) -> bool:
        """Ask for a press again that failed, and return whether it is: not when nobody came, nor without end."""
        if isinstance(end, PressEnded) and end.state != "rejected":
            raise end
        log.warning("press %d of the scan: %s", self._ramps + 1, end)
        self._failed += 1
        if self._failed >= MAX_FAILED or self._capture.machine.touched_s is None:
            return False
        self._capture.drop_ramp()
        self._tell(str(end))
        self._board.update(guidance=Guidance.LIFT)
        return True
