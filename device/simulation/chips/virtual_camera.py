"""A rendered scene seen through the interface of picamera2: frame clock, buffers, flush, silent adjustment.

Frame k is exposed from start + k * frame duration whether or not anyone asks for it; only a frame that is asked for
is rendered, with the light as it was when its exposure began. A torn frame holds the exposure before from some row on.
Source: picamera2 0.3.38 (`Picamera2.capture_request`, `wait_for_timestamp_`, `CompletedRequest.release`, `Controls`).
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.tactile_image import Counts
from device.simulation.chips.faulty_frames import FaultyFrames
from device.simulation.chips.frame_clock import ClockedFrame, FrameClock, Timing
from device.simulation.faults import NO_FAULTS, FaultTimeline

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


Render = Callable[[ExposureRequest], Counts]

Stream = dict[str, Any]
"""Format, size, stride ... of one stream, or a whole camera configuration, as picamera2 passes them about."""

RAW_FORMATS = {"R8", "R10", "R12", "R16", "R8_CSI2P", "R10_CSI2P", "R12_CSI2P", "MONO_PISP_COMP1"}
UNPACKED_BITS = {"R8": 8, "R10": 10, "R12": 12, "R16": 16}
BUFFER_COUNT = 4
CONTROL_DELAY_FRAMES = 2
"""The frame that is being exposed, and the next, are as they were (libcamera: delays of the OV9281's controls)."""
STRIDE_ALIGNMENT = 64
GAIN_STEP = 1 / 16
LONGEST_FRAME_US = 1_000_000


class VirtualPicamera2:
    """The part of `picamera2.Picamera2` that a monochrome raw stream needs, with its wording of errors.

    `render` makes the image of one exposure, of 8 bits, or with its bits at the top of 16; `led_ratio_at` is the light
    at a time (s, monotonic). The sensor has one size, width_px x height_px, in each of `raw_formats`: anything else is
    silently adjusted, the format to the first of them. Controls act from the next start, or while the sensor runs two
    frames later. `faults` says which frames do not come, and which come torn.
    """

    def __init__(
        self,
        render: Render,
        *,
        width_px: int,
        height_px: int,
        led_ratio_at: Callable[[float], LedRatio],
        raw_formats: tuple[str, ...] = ("R8",),
        max_frame_rate_hz: float = 120.0,
        faults: FaultTimeline = NO_FAULTS,
    ) -> None:
        self._render = render
        self._size = (width_px, height_px)
        self._raw_formats, self._raw_format, self._stride = raw_formats, raw_formats[0], 0
        self._led_ratio_at, self._frames = led_ratio_at, FaultyFrames(faults)
        shortest_us = round(1e6 / max_frame_rate_hz)
        # A monochrome sensor advertises no white balance and no colour controls.
        self.camera_controls: dict[str, tuple[Any, Any, Any]] = {
            "AeEnable": (False, True, True),
            "ExposureTime": (1, LONGEST_FRAME_US, 20_000),
            "AnalogueGain": (1.0, 16.0, 1.0),
            "FrameDurationLimits": (shortest_us, LONGEST_FRAME_US, 33_333),
        }
        self._configuration: Stream | None = None
        self._controls: dict[str, Any] = {}
        self._changed = threading.Condition()
        self._clock: FrameClock | None = None
        self._next_number, self._taken_before = 0, 0
        self._buffers_held = 0
        self._abandoned_jobs = 0

    def create_video_configuration(
        self,
        main: Stream | None = None,
        raw: Stream | None = None,
        buffer_count: int = 6,
        controls: dict[str, Any] | None = None,
        display: str | None = "main",
        encode: str | None = "main",
    ) -> Stream:
        """Return a configuration to pass to `configure`."""
        main = {"format": "XBGR8888", "size": (1280, 720)} | (main or {})
        raw = {"format": "R8", "size": main["size"]} | (raw or {})
        streams = {"main": main, "lores": None, "raw": raw, "display": display, "encode": encode}
        return {"use_case": "video", "buffer_count": buffer_count, "controls": controls or {}} | streams

    def configure(self, camera_config: Stream) -> None:
        """Take a configuration, adjusted in silence to what the sensor has."""
        if self._clock is not None:
            raise RuntimeError("Camera must be stopped before configuring")
        raw = camera_config["raw"]
        if raw["format"] not in RAW_FORMATS:
            raise RuntimeError("Unrecognised raw format " + raw["format"])
        if any(side % 2 for side in raw["size"]):
            raise RuntimeError("width and height should be even")
        self._raw_format = raw["format"] if raw["format"] in self._raw_formats else self._raw_formats[0]
        row_bytes = self._size[0] * (1 if self._raw_format == "R8" else 2)
        self._stride = -(-row_bytes // STRIDE_ALIGNMENT) * STRIDE_ALIGNMENT
        adjusted = {"format": self._raw_format, "size": self._size, "stride": self._stride}
        self._configuration = camera_config | {"raw": raw | adjusted}
        self._controls = {}
        self.set_controls(camera_config["controls"])

    def camera_configuration(self) -> Stream | None:
        """Return the configuration that holds, or None before the first one."""
        return self._configuration

    def set_controls(self, controls: dict[str, Any]) -> None:
        """Set controls; values out of range are clamped in silence."""
        for name in controls:
            if name not in self.camera_controls:
                raise RuntimeError(f"Control {name} is not advertised by libcamera")
        with self._changed:
            self._controls |= controls
            if self._clock is not None:
                under_way = self._clock.first_begun_after(time.monotonic_ns()) - 1
                self._clock.change(max(0, under_way) + CONTROL_DELAY_FRAMES, self._timing())

    def start(self) -> None:
        """Start the frame clock; a camera that was not configured takes a configuration of its own."""
        if self._configuration is None:
            self.configure(self.create_video_configuration())
        with self._changed:
            if self._clock is None:
                self._clock = FrameClock(time.monotonic_ns(), self._timing())
                self._next_number = self._buffers_held = self._abandoned_jobs = 0
                self._changed.notify_all()

    def stop(self) -> None:
        """Stop the frame clock; requests that are still out lose their buffer."""
        with self._changed:
            self._clock = None
            self._taken_before += self._next_number  # no frame has the noise of another one
            self._next_number = 0

    def close(self) -> None:
        """Stop, and give the camera up."""
        self.stop()
        self._configuration = None

    def capture_request(self, *, wait: float | None = None, flush: int | None = None) -> VirtualRequest:
        """Return the last finished frame or the next, of those begun at or after `flush` (ns, monotonic).

        Blocks while the camera is stopped or all buffers are out; after `wait` seconds raises a bare `TimeoutError`
        and leaves its job behind, which keeps a buffer until `cancel_all_and_flush`.
        """
        self._frames.answer()
        deadline_ns = math.inf if wait is None else time.monotonic_ns() + 1e9 * wait
        with self._changed:
            self._changed.wait_for(self._is_flowing, wait)
            frame = self._claim_frame(flush or 0, deadline_ns) if self._is_flowing() else None
            self._buffers_held += 1
        _sleep_until(frame.exposure_end_ns if frame else deadline_ns)
        if frame is None:
            with self._changed:
                self._abandoned_jobs += 1
            raise TimeoutError
        shown, torn_into = self._frames.shown_in(frame), self._frames.torn_into(frame)
        return VirtualRequest(self, self._exposure(shown), frame, self._exposure(torn_into) if torn_into else None)

    def cancel_all_and_flush(self) -> None:
        """Drop the jobs that timed-out captures left behind."""
        with self._changed:
            self._buffers_held -= self._abandoned_jobs
            self._abandoned_jobs = 0
            self._changed.notify_all()

    def take_back(self, clock: FrameClock) -> None:
        """Queue the buffer of a released request again, unless the camera was stopped since."""
        with self._changed:
            if clock is self._clock:
                self._buffers_held -= 1
                self._changed.notify_all()

    def render_rows(self, exposure: ExposureRequest) -> NDArray[np.uint8]:
        """Return the rendered exposure as bytes, low ones first, with its rows padded to the stride."""
        image = self._render(exposure)
        if self._raw_format != "R8":
            image = (image >> (16 - UNPACKED_BITS[self._raw_format])).astype("<u2").view(np.uint8)
        return np.pad(image, ((0, 0), (0, self._stride - image.shape[1])))

    def _is_flowing(self) -> bool:
        return self._clock is not None and self._buffers_held < BUFFER_COUNT

    def _claim_frame(self, flush_ns: int, deadline_ns: float) -> ClockedFrame | None:
        """Return the frame to deliver, or None when it ends too late. Needs a running clock and the lock."""
        assert self._clock is not None
        finished = self._clock.last_ended_before(time.monotonic_ns())
        frame = self._clock.frame(max(self._next_number, finished, self._clock.first_begun_after(flush_ns)))
        while frame.exposure_end_ns <= deadline_ns and not self._frames.is_delivered(frame):
            frame = self._clock.frame(frame.number + 1)
        if frame.exposure_end_ns > deadline_ns:
            return None
        self._next_number = frame.number + 1
        return frame

    def _exposure(self, frame: ClockedFrame) -> ExposureRequest:
        start_s, exposure_s = 1e-9 * frame.exposure_start_ns, 1e-9 * frame.timing.exposure_ns
        return ExposureRequest(
            t_s=start_s + exposure_s / 2,
            exposure_us=frame.timing.exposure_ns // 1000,
            gain=frame.timing.gain,
            led_ratio=self._led_ratio_at(start_s),
            frame_number=self._taken_before + frame.number,
        )

    def _timing(self) -> Timing:
        frame_us = int(self._clamped("FrameDurationLimits"))
        exposure_us = min(int(self._clamped("ExposureTime")), frame_us)
        return Timing(1000 * frame_us, 1000 * exposure_us, round(self._clamped("AnalogueGain") / GAIN_STEP) * GAIN_STEP)

    def _clamped(self, name: str) -> float:
        low, high, default = self.camera_controls[name]
        value = self._controls.get(name, default)
        first = value[0] if isinstance(value, tuple) else value
        return float(min(max(first, low), high))


def _sleep_until(t_ns: float) -> None:
    time.sleep(max(0.0, t_ns - time.monotonic_ns()) * 1e-9)
