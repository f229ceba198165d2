"""The camera in a process of its own: when its library hangs or dies, that process is ended and another one started.

A frame that is lost that way is not made up for: the call that waited for it raises, within its own deadline, and the
next call starts the process again. How often it may is bounded, so that a broken camera is a fault and not a loop.
"""

from __future__ import annotations

import logging
import threading

from device.errors import CameraError, CameraProcessError
from device.hardware.camera_child import CameraChild
from device.hardware.camera_worker import CameraOpener
from device.hardware.interfaces import CameraFrame
from device.hardware.restart_limit import RestartLimit

log = logging.getLogger(__name__)

WINDOW_S = 60.0
REMEDY = "Check the camera's ribbon cable, then restart the probe."


class CameraProcess:
    """A camera that another process has open. Implements `Camera`; may be closed from any thread."""

    def __init__(self, opener: CameraOpener, *, shape: tuple[int, int], limit: RestartLimit) -> None:
        """Open the camera of frames [height_px, width_px]; raise what the opener raises, or `CameraProcessError`."""
        self._opener, self._shape, self._limit = opener, shape, limit
        self._lock = threading.Lock()
        self._is_closed = False
        self._child: CameraChild | None = CameraChild(opener, shape)

    @property
    def pid(self) -> int | None:
        """Number of the camera's process; None while there is none."""
        return self._child.pid if self._child else None

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        """Return the next frame whose exposure began at or after `begun_after_s` (s, monotonic).

        Raises `CameraError` when none comes within `timeout_s`, `CameraProcessError` when the process hangs or has
        ended; the next call starts it again, which may take longer, and raises it too when that is too often.
        """
        with self._lock:
            child = self._child = self._child or self._restarted()
            try:
                return child.capture(begun_after_s=begun_after_s, timeout_s=timeout_s)
            except CameraProcessError:
                self._child = None
                child.kill()
                raise

    def _restarted(self) -> CameraChild:
        if self._is_closed:
            raise CameraError("The camera is closed.", "Restart the probe.")
        if not self._limit.allows_one():
            often = f"{self._limit.max_restarts} times within {self._limit.window_s:g} s"
            raise CameraProcessError(f"The camera's process was started again {often}, in vain.", REMEDY)
        log.warning("the camera's process is started again")
        return CameraChild(self._opener, self._shape)

    def close(self) -> None:
        """End the process and its camera; waits for a capture under way, which has its deadline."""
        with self._lock:
            self._is_closed = True
            if self._child:
                self._child.close()
                self._child = None
