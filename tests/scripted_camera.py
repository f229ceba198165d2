"""Cameras for a process of their own, which misbehave on command; as a program, a daemon that has one open.

`python scripted_camera.py` opens a camera that hangs, prints its process's number and memory, and waits for a frame.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from functools import partial
from pathlib import Path

import numpy as np

from device.errors import CameraError, LateFrameError
from device.hardware.camera_process import CameraProcess
from device.hardware.interfaces import CameraFrame
from device.hardware.restart_limit import RestartLimit
from device.measurement.quantities import Bound, require

SHAPE = (6, 8)
FOREVER = threading.Event()


class ScriptedCamera:
    """Frame k has k counts, began at the time that was asked for, and may be the one that goes wrong."""

    def __init__(self, hangs_at: int = 0, dies_at: int = 0, fails_at: int = 0) -> None:
        self.hangs_at, self.dies_at, self.fails_at = hangs_at, dies_at, fails_at
        self.taken = 0

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        self.taken += 1
        if self.taken == self.hangs_at:
            FOREVER.wait()
        if self.taken == self.dies_at:
            os.kill(os.getpid(), signal.SIGKILL)
        if self.taken == self.fails_at:
            raise LateFrameError("Frames are late.", "Wait.")
        return CameraFrame(np.full(SHAPE, self.taken, np.uint8), begun_after_s, 1e6 * timeout_s, 1.0)

    def rest(self) -> None:
        pass

    def close(self) -> None:
        pass


def absent_camera() -> ScriptedCamera:
    raise CameraError("There is no camera.", "Buy one.")


def misconfigured_camera() -> ScriptedCamera:
    require("exposure_us", 3.0, Bound(0.0, 2.0, "us"), "shorten it")
    return ScriptedCamera()


def hanging_opener() -> ScriptedCamera:
    FOREVER.wait()
    return ScriptedCamera()


def camera_that_tells_what_is_imported() -> ScriptedCamera:
    raise CameraError(" ".join(sys.modules), "Read it.")


def scripted_process(max_restarts: int = 3, **script: int) -> CameraProcess:
    camera = CameraProcess(partial(ScriptedCamera, **script), shape=SHAPE, limit=RestartLimit(max_restarts, 60.0))
    camera.require_open()
    return camera


def memory_of(camera: CameraProcess) -> Path:
    """Where the shared memory would be seen if it still had its name."""
    assert camera._child
    return Path("/dev/shm") / camera._child._ring.name.lstrip("/")


if __name__ == "__main__":
    camera = scripted_process(hangs_at=1)
    print(camera.pid, memory_of(camera), flush=True)
    camera.capture(begun_after_s=0.0, timeout_s=600.0)
