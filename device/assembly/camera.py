"""Puts the camera together: the driver in a process of its own, above picamera2 or above the virtual one.

The camera's process imports this file: nothing here may need the web server or the network's runtime.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from device.config import CameraSection
from device.errors import DeviceError
from device.hardware.camera import RawMonoCamera, open_camera
from device.hardware.camera_process import WINDOW_S, CameraProcess
from device.hardware.camera_worker import CameraOpener
from device.hardware.interfaces import Camera
from device.hardware.restart_limit import RestartLimit
from device.measurement.quantities import InvalidQuantity
from device.simulation.chips.remote_camera import RemotePicamera2


def real_camera(settings: CameraSection) -> CameraProcess:
    """Start to open the board's camera in its process; `require_open` says how that ends."""
    return _in_its_process(partial(open_camera, settings.index, **_driver_settings(settings)), settings)


def emulated_camera(settings: CameraSection, address: str) -> CameraProcess:
    """Start to open the camera that a `CameraServer` serves at an address, as `real_camera` does."""
    return _in_its_process(partial(open_remote_camera, address, **_driver_settings(settings)), settings)


def require_open(camera: Camera) -> None:
    """Wait for a camera that opens in its process; raise what keeps it from that."""
    if isinstance(camera, CameraProcess):
        camera.require_open()


def open_remote_camera(address: str, **driver_settings: Any) -> RawMonoCamera:
    """Open the served camera in this process."""
    picam2 = RemotePicamera2(address)
    try:
        return RawMonoCamera(picam2, **driver_settings)
    except (DeviceError, InvalidQuantity):
        picam2.close()
        raise


def _in_its_process(opener: CameraOpener, settings: CameraSection) -> CameraProcess:
    limit = RestartLimit(settings.max_restarts, WINDOW_S)
    return CameraProcess(opener, shape=(settings.height_px, settings.width_px), limit=limit)


def _driver_settings(settings: CameraSection) -> dict[str, Any]:
    return {
        "mode": settings.raw_mode,
        "exposure_us": settings.exposure_us,
        "gain": settings.gain,
        "frame_rate_hz": settings.frame_rate_hz,
    }
