"""The real picamera2 on libcamera's virtual camera, which has no raw stream and no exposure.

Three things of a sensor are missing and are put in its place: the list of raw modes, an allocator of one plane a
buffer, and a display. Everything else is picamera2 as it is.
"""

from __future__ import annotations

from typing import Any

from picamera2 import Picamera2
from picamera2.allocators import LibcameraAllocator


class VirtualSensorPicamera2(Picamera2):  # type: ignore[misc]
    """A `Picamera2` that does not ask for raw modes, and whose buffers libcamera allocates."""

    def _get_raw_modes(self) -> list[dict[str, Any]]:
        return [{"format": "NV12", "size": (768, 492)}]  # as of a webcam


def open_virtual_camera() -> VirtualSensorPicamera2:
    """Return the first camera; needs dmabuf_shim.c preloaded and virtual.yaml installed (make_root.sh)."""
    camera = VirtualSensorPicamera2(0)
    camera.allocator = LibcameraAllocator(camera.camera)
    return camera
