"""What the camera's own process costs: a frame handed over with and without it, and frames that come through it."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from device.assembly.camera import emulated_camera
from device.config import CameraSection
from device.hardware.camera_process import CameraProcess
from device.hardware.interfaces import CameraFrame
from device.hardware.restart_limit import RestartLimit
from device.simulation.chips.camera_server import CameraServer
from device.simulation.chips.virtual_camera import VirtualPicamera2

CAMERA = CameraSection()
SHAPE = CAMERA.height_px, CAMERA.width_px
FRAMES = 180


class StillCamera:
    """Gives a copy of one picture at once, as the driver does with the camera's buffer."""

    def __init__(self) -> None:
        self._counts = np.zeros(SHAPE, np.uint8)

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        return CameraFrame(self._counts.copy(), begun_after_s, 1.0, 1.0)

    def rest(self) -> None:
        pass

    def close(self) -> None:
        pass


class Handover:
    """One picture, from a camera in this process and from one in its own."""

    def __init__(self) -> None:
        self._here = StillCamera()
        self._there = CameraProcess(StillCamera, shape=SHAPE, limit=RestartLimit(0, 60.0))

    def here(self) -> CameraFrame:
        return self._here.capture(begun_after_s=0.0, timeout_s=5.0)

    def through_its_process(self) -> CameraFrame:
        return self._there.capture(begun_after_s=0.0, timeout_s=5.0)

    def close(self) -> None:
        self._there.close()


def sustained_hz(frame_rate_hz: float) -> float:
    """Return how many frames a second of a virtual camera's come through its process when each next one is asked for.

    The picture is ready: what its rendering takes is another row of the table.
    """
    picture = np.zeros(SHAPE, np.uint8)
    settings = replace(CAMERA, frame_rate_hz=frame_rate_hz)
    width_px, height_px = settings.width_px, settings.height_px
    server = CameraServer(
        lambda: VirtualPicamera2(
            lambda _: picture, width_px=width_px, height_px=height_px, led_ratio_at=lambda _: (0.0, 0.0, 0.0, 0.0)
        )
    )
    camera = emulated_camera(settings, server.address)
    begun_s = [camera.capture(begun_after_s=time.monotonic(), timeout_s=5.0).exposure_start_s]
    while len(begun_s) <= FRAMES:
        begun_s.append(camera.capture(begun_after_s=begun_s[-1] + 1e-6, timeout_s=5.0).exposure_start_s)
    camera.close()
    server.close()
    return FRAMES / (begun_s[-1] - begun_s[0])
