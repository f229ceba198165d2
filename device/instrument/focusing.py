"""Holds the LEDs on and looks at what the camera sees, for whoever turns the lens and sets exposure, gain and light.

It needs neither load cell nor model nor certificate: a probe that is being built has none yet. The light obeys what
every press's does: the check of its currents, its budget, its enable line, and it is read back five times a second.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Generator
from contextlib import ExitStack

from device.errors import DeviceError
from device.instrument.acquisition.bench import LitCamera
from device.instrument.acquisition.frame_quality import FrameQuality, QualityWatch
from device.instrument.press.states import Guidance
from device.instrument.status import StatusBoard
from device.measurement.mode import Mode
from device.measurement.recording.led_sides import LedRatio

log = logging.getLogger(__name__)
DARK_FRAMES = 8
LOOK_EVERY_S = 0.2
"""Well within the 0.75 s after which the keeper of the enable line takes the light away."""
LOOKS_A_SECOND = 5


class Focusing:
    """Frames under a light that is held, once a second, until it is told to stop; `board` leads the operator."""

    def __init__(self, lit: LitCamera, opened: ExitStack, count_light: Callable[[float], None]) -> None:
        """Take light and camera, what closes all that is opened, and what counts how long (s) the LEDs were on."""
        self.board = StatusBoard()
        self._lit, self._opened, self._count_light = lit, opened, count_light

    def on_request(self, listener: Callable[[Mode], None]) -> None:
        """Do nothing with it: no press begins here."""

    def seconds(self, ratio: LedRatio, stopped: threading.Event) -> Generator[FrameQuality, None, None]:
        """Yield the newest frame's quality each second, the sides lit so, until `stopped` is set; ends dark.

        Raises `LightBudgetError` when the light has been on for as long as the settings allow, and the `DeviceError` of
        a part that fails.
        """
        watch = QualityWatch([self._lit.expose().counts for _ in range(DARK_FRAMES)])
        if stopped.is_set():
            return
        try:
            self._lit.check_lights()
            self._lit.light(ratio)
            self.board.update(guidance=Guidance.HOLD_BLOCK)
            while not stopped.is_set():
                looked = [self._look(watch, stopped) for _ in range(LOOKS_A_SECOND)]
                if newest := looked[-1]:
                    yield newest
        finally:
            self._darken()

    def _look(self, watch: QualityWatch, stopped: threading.Event) -> FrameQuality | None:
        """Return the quality of a frame a little later, None once it is told to stop."""
        if stopped.wait(LOOK_EVERY_S):
            return None
        self._lit.budget.require_left()
        self._lit.progress.beat()
        return watch.saw(self._lit.expose().counts)

    def _darken(self) -> None:
        """Switch the light off for good; what ended the light is not hidden by a chip that does not answer any more."""
        try:
            self._lit.darken_for_good()
        except DeviceError as error:
            log.error("%s %s", error.code, error)

    def close(self) -> None:
        """Make sure that it is dark, count how long the light was on, and release every part."""
        try:
            self._darken()
            self._count_light(self._lit.budget.unsaved_s)
        except DeviceError as error:
            log.error("%s %s", error.code, error)
        finally:
            self._opened.close()
