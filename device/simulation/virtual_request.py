"""One delivered frame of the virtual camera: rendered when it is asked for, with what the camera says about it.

A torn frame holds the exposure before from some row on. Source: picamera2 0.3.38 (`CompletedRequest`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.led_sides import LedRatio
from device.simulation.frame_clock import ClockedFrame

if TYPE_CHECKING:
    from device.simulation.virtual_camera import VirtualPicamera2

TORN_FROM = 0.5
"""Where, as a part of its height, a torn frame goes over to the exposure before."""


@dataclass(frozen=True)
class ExposureRequest:
    """One exposure to render: mid-exposure time (s, monotonic), its settings, and the light at its start."""

    t_s: float
    exposure_us: int
    gain: float
    led_ratio: LedRatio
    frame_number: int


class VirtualRequest:
    """One delivered frame: picamera2's `CompletedRequest`. It holds a buffer until it is released."""

    def __init__(
        self,
        camera: VirtualPicamera2,
        exposure: ExposureRequest,
        frame: ClockedFrame,
        torn_into: ExposureRequest | None = None,
    ) -> None:
        self._camera = camera
        self._exposure, self._torn_into = exposure, torn_into
        self._frame = frame
        self._is_released = False

    def make_array(self, name: str) -> NDArray[np.uint8]:
        """Render and return the rows of the raw stream, padded to its stride: bytes [height_px, stride]."""
        if name != "raw":
            raise RuntimeError(f"Stream {name!r} is not defined")
        if self._is_released:
            raise RuntimeError("CompletedRequest: used after release")
        rows = self._camera.render_rows(self._exposure)
        if self._torn_into:
            first = round(TORN_FROM * len(rows))
            rows[first:] = self._camera.render_rows(self._torn_into)[first:]
        return rows

    def get_metadata(self) -> dict[str, Any]:
        """Return what the camera really did: end of the exposure (ns), exposure (us), gain, frame duration (us)."""
        return {
            "SensorTimestamp": self._frame.exposure_end_ns,
            "ExposureTime": self._exposure.exposure_us,
            "AnalogueGain": self._exposure.gain,
            "FrameDuration": self._frame.timing.frame_ns // 1000,
        }

    def release(self) -> None:
        """Give the buffer back to the camera."""
        if self._is_released:
            raise RuntimeError("CompletedRequest: lock now has negative ref_count")
        self._is_released = True
        self._camera.take_back(self._frame.clock)
