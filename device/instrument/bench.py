"""Light, camera and force as one: a frame that knows under which light and force it was taken."""

from __future__ import annotations

from dataclasses import dataclass

from device.hardware.interfaces import Camera, Lights
from device.instrument.force_recorder import ForceRecorder
from device.measurement.tactile_image import Frame, LedRatio, Role

DARK: LedRatio = (0.0, 0.0, 0.0, 0.0)
FRAME_TIMEOUT_S = 2.0
STEADY_WINDOW_S = 0.15


@dataclass
class Bench:
    """The opened hardware. Owned by the procedure's thread alone, except `force`, which anyone may read."""

    lights: Lights
    camera: Camera
    force: ForceRecorder
    _light: LedRatio = DARK
    _not_before_s: float = 0.0

    def light(self, ratio: LedRatio) -> None:
        """Set the four sides; frames begun before the chip acknowledged it are not taken."""
        if ratio != self._light or not self._not_before_s:
            self._not_before_s = self.lights.set_ratio(ratio)
            self._light = ratio

    def take(self, role: Role) -> Frame:
        """Return the next frame under the present light, with the force in the middle of its exposure."""
        taken = self.camera.capture(begun_after_s=self._not_before_s, timeout_s=FRAME_TIMEOUT_S)
        self._not_before_s = taken.exposure_start_s + 1e-6
        middle_s = taken.exposure_start_s + taken.exposure_us * 0.5e-6
        return Frame(taken.counts, role, middle_s, self.force.at(middle_s), self._light)

    def is_steady(self, t_s: float, steady_n: float) -> bool:
        """Return whether the force hardly varied just before a time: a ramp through the band is no hold."""
        return self.force.range_n(t_s, window_s=STEADY_WINDOW_S) <= steady_n
