"""Light, camera and force as one: a frame that knows under which light and force it was taken."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from device.hardware.interfaces import Camera, Lights
from device.instrument.force_recorder import ForceRecorder
from device.instrument.frame_check import FramePace
from device.instrument.frame_level import LevelWatch
from device.instrument.light_budget import LightBudget
from device.measurement.tactile_image import Frame, LedRatio, Role

DARK: LedRatio = (0.0, 0.0, 0.0, 0.0)
FRAME_TIMEOUT_S = 1.0
LATE_S = 0.1
"""Three frames of 30 Hz."""
STEADY_WINDOW_S = 0.15


@dataclass
class Bench:
    """The opened hardware. Owned by the procedure's thread alone, except `force`, which anyone may read."""

    lights: Lights
    camera: Camera
    force: ForceRecorder
    pace: FramePace = field(default_factory=lambda: FramePace(LATE_S))
    budget: LightBudget = field(default_factory=LightBudget)
    levels: LevelWatch = field(default_factory=LevelWatch)
    _light: LedRatio = DARK
    _not_before_s: float = 0.0

    def light(self, ratio: LedRatio) -> None:
        """Set the four sides; frames begun before the chip acknowledged it are not taken.

        After a `LightError` nobody knows what the light is: it is set again at the next call, whatever it asks for.
        """
        if ratio != self._light or not self._not_before_s:
            self._not_before_s = 0.0
            if any(ratio):
                self.budget.note_lit()
            self._not_before_s = self.lights.set_ratio(ratio)
            self._light = ratio
            if not any(ratio):
                self.budget.note_dark()

    def check_lights(self) -> None:
        """Raise `OpenLedError` or `HotLedDriverError` when the LED chip says that current does not flow; ends dark."""
        self._not_before_s = 0.0
        self.lights.check_outputs()
        self.budget.note_dark()

    def take(self, role: Role) -> Frame:
        """Return the next frame under the present light, with the force in the middle of its exposure.

        Raises `CameraError` when none comes, most are left out or one shows another light, `LoadCellError` when its
        force is not known.
        """
        asked_s = max(time.monotonic(), self._not_before_s)
        taken = self.camera.capture(begun_after_s=self._not_before_s, timeout_s=FRAME_TIMEOUT_S)
        self.pace.saw(asked_s, taken.exposure_start_s)
        self._not_before_s = taken.exposure_start_s + 1e-6
        middle_s = taken.exposure_start_s + taken.exposure_us * 0.5e-6
        frame = Frame(taken.counts, role, middle_s, self.force.at(middle_s), self._light)
        self.levels.saw(frame)
        return frame

    def is_steady(self, t_s: float, steady_n: float) -> bool:
        """Return whether the force hardly varied just before a time: a ramp through the band is no hold."""
        return self.force.range_n(t_s, window_s=STEADY_WINDOW_S) <= steady_n

    def rate_n_per_s(self, t_s: float) -> float:
        """Return how fast the force grew just before a time, tremor averaged out; negative while the hand eases."""
        return (self.force.at(t_s) - self.force.at(t_s - STEADY_WINDOW_S)) / STEADY_WINDOW_S
