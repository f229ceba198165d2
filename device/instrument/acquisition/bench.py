"""Light, camera and force as one: a frame that knows under which light and force it was taken.

Light and camera alone, `LitCamera`, are what a probe has that is being built: its lens is focused without a load cell.
"""

from __future__ import annotations

import threading
import time
from dataclasses import KW_ONLY, dataclass, field

from device.hardware.interfaces import Camera, CameraFrame, Lights
from device.instrument.acquisition.force_recorder import ForceRecorder
from device.instrument.acquisition.frame_check import FramePace
from device.instrument.acquisition.frame_level import LevelWatch
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press.machine import STEADY_WINDOW_S
from device.instrument.watch.progress import ProgressBoard
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.tactile_image import Frame, Role

DARK: LedRatio = (0.0, 0.0, 0.0, 0.0)
FRAME_TIMEOUT_S = 1.0
LATE_S = 0.1
"""Three frames of 30 Hz."""
LOOK_AT_RESTING_EVERY_S = 3.0
"""Within the 5 s for which a part that was seen working is believed (device/instrument/watch/readiness.py)."""
LOOK_AT_LIGHT_EVERY_S = 0.2
"""With the 0.75 s after which the keeper of the enable line gives up, a bus that hangs is dark within a second."""


@dataclass
class LitCamera:
    """The opened light and camera. Owned by one thread alone.

    Any thread may make it dark for good, and look at `newest`: the frame that was taken last, None before the first.
    """

    lights: Lights
    camera: Camera
    _: KW_ONLY
    pace: FramePace = field(default_factory=lambda: FramePace(LATE_S))
    budget: LightBudget = field(default_factory=LightBudget)
    progress: ProgressBoard = field(default_factory=ProgressBoard)
    newest: CameraFrame | None = None
    _light: LedRatio = DARK
    _is_known: bool = False
    _not_before_s: float = 0.0
    _is_over: bool = False
    _is_resting: bool = False
    _frame_s: float = 0.0
    _lock: threading.Lock = field(default_factory=lambda: threading.Lock())

    def __post_init__(self) -> None:
        self.progress.exercise("camera", self._look)
        self.progress.exercise("light", self._confirm_light, LOOK_AT_LIGHT_EVERY_S)

    def light(self, ratio: LedRatio) -> None:
        """Set the four sides; frames begun before the chip acknowledged it are not taken.

        After a `LightError` nobody knows what the light is: it is set again at the next call, whatever it asks for.
        Once it was made dark for good it stays so.
        """
        with self._lock:
            self._set(DARK if self._is_over else ratio)

    def darken_for_good(self) -> None:
        """Switch the light off now, whatever the procedure is in, and never on again; raises `LightError`."""
        self._is_over = True  # before the lock: whoever holds it is the last that may have lit
        with self._lock:
            self._is_known = False
            self.lights.set_ratio(DARK)  # not `inside` a part: the loop whose progress that is may be in another
            self._light, self._is_known = DARK, True
            self.budget.note_dark()

    def _set(self, ratio: LedRatio) -> None:
        if ratio != self._light or not self._is_known:
            self._is_known = False
            if any(ratio):
                self.budget.note_lit()
            self._not_before_s = self._acknowledged_s(ratio)
            self._light, self._is_known = ratio, True
            if not any(ratio):
                self.budget.note_dark()

    def check_lights(self) -> None:
        """Raise `OpenLedError` or `HotLedDriverError` when the LED chip says that current does not flow; ends dark."""
        with self._lock:
            self._is_known = False
            if not self._is_over:
                with self.progress.inside("light"):
                    self.lights.check_outputs()
                self.budget.note_dark()

    def expose(self) -> CameraFrame:
        """Return the next frame under the present light, whatever the force.

        Raises `CameraError` when none comes, or most are left out.
        """
        asked_s, was_resting = max(time.monotonic(), self._not_before_s), self._is_resting
        taken = self._capture()
        if not was_resting:
            self.pace.saw(asked_s, taken.exposure_start_s)
        return taken

    def _capture(self) -> CameraFrame:
        with self.progress.inside("camera"):
            taken = self.camera.capture(begun_after_s=self._not_before_s, timeout_s=FRAME_TIMEOUT_S)
        self._is_resting, self._frame_s, self.newest = False, time.monotonic(), taken
        self._not_before_s = taken.exposure_start_s + 1e-6
        self._go_on()
        return taken

    def _go_on(self) -> None:
        """Hold the light that the frame was taken under, since all before has come back; it may have gone off."""
        with self._lock:
            if self._is_over or not (self._is_known and any(self._light)):
                return
            self._is_known = False
            self.lights.go_on()
            self._is_known = True

    def check_line(self) -> bool:
        """Return whether the LED chip has shown that it obeys its enable line; raise `LightLineError`. Ends dark."""
        self.light(DARK)
        with self._lock, self.progress.inside("light"):
            return self.lights.check_line()

    def rest(self) -> None:
        """Let the camera rest until a frame is needed; raises `CameraError`."""
        if not self._is_resting:
            with self.progress.inside("camera"):
                self.camera.rest()
            self._is_resting = True

    def _look(self) -> None:
        """Take a frame that nobody needs; a camera that rests is woken for it more seldom, and rests again."""
        if not self._is_resting:
            self._capture()
        elif time.monotonic() - self._frame_s >= LOOK_AT_RESTING_EVERY_S:
            self._capture()
            self.rest()

    def _acknowledged_s(self, ratio: LedRatio) -> float:
        with self.progress.inside("light"):
            return self.lights.set_ratio(ratio)

    def _confirm_light(self) -> None:
        """Write what the light is once more, and have it read back; frames that were begun under it remain good.

        A light that nobody knows is switched off.
        """
        with self._lock:
            if not self._is_known or self._is_over:
                self._set(DARK)
                return
            self._is_known = False
            self._acknowledged_s(self._light)
            self._is_known = True


@dataclass
class Bench(LitCamera):
    """The opened hardware. Owned by the procedure's thread alone, except `force`, which anyone may read."""

    force: ForceRecorder
    levels: LevelWatch = field(default_factory=LevelWatch, kw_only=True)

    def take(self, role: Role) -> Frame:
        """Return the next frame under the present light, with the force in the middle of its exposure.

        Raises `CameraError` when none comes, most are left out or one shows another light, `LoadCellError` when its
        force is not known.
        """
        taken = self.expose()
        middle_s = taken.exposure_start_s + taken.exposure_us * 0.5e-6
        frame = Frame(taken.counts, role, middle_s, self.force.at(middle_s), self._light)
        if not self._is_over:
            self.levels.saw(frame)
        return frame

    def rest(self) -> None:
        """Let the camera rest, and the load cell's samples gather, until a frame is needed; raises `CameraError`."""
        self.force.take_time()
        super().rest()

    def range_n(self, t_s: float, *, around_line: bool) -> float:
        """Return by how much the force varied just before a time, or on a ramp around it: a ramp is no hold."""
        return self.force.range_n(t_s, window_s=STEADY_WINDOW_S, around_line=around_line)

    def peak_n(self, since_s: float, t_s: float) -> float:
        """Return the largest force of the samples after one time and until another, and of the latter itself."""
        return self.force.peak_n(since_s, t_s)

    def rate_n_per_s(self, t_s: float) -> float:
        """Return how fast the force grew just before a time, tremor averaged out; negative while the hand eases."""
        return (self.force.at(t_s) - self.force.at(t_s - STEADY_WINDOW_S)) / STEADY_WINDOW_S
