"""Frames of the near-infrared camera, untouched, each known to have begun after the light was set.

Easy to get wrong: libcamera adjusts what it is asked for without a word, so the configuration is read back; and only
the raw stream is photometric, main and lores pass black level, gamma and contrast of the image processor.
Source: picamera2 0.3.38 (Raspberry Pi, "The Picamera2 Library").
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from device.config_chips import RAW_BITS, RawMode
from device.errors import CameraError
from device.hardware.interfaces import CameraFrame
from device.measurement.quantities import Bound, InvalidQuantity, require

if TYPE_CHECKING:
    from picamera2 import CompletedRequest, Picamera2

BUFFER_COUNT = 4
EXPOSURE_STEP_US = 50
"""A sensor exposes for a whole number of its rows, none of which takes longer."""
GAIN_STEP_RATIO = 0.05
"""Steps of the gain are sixteenths or finer."""
CABLE_REMEDY = "Check the camera's ribbon cable, then restart the probe."


def open_camera(index: int, *, mode: RawMode, exposure_us: int, gain: float, frame_rate_hz: float) -> RawMonoCamera:
    """Open the board's camera `index` and start it; raise `CameraError` when there is no camera or no picamera2."""
    try:
        from picamera2 import Picamera2
    except ImportError as error:
        cause = "picamera2 is not installed, so no real camera can be opened."
        raise CameraError(cause, "Install python3-picamera2 on the probe, or start with --simulate.") from error
    except ValueError as error:  # of a compiled part of it that another NumPy was there for
        cause = f"picamera2 cannot be loaded: {error}."
        raise CameraError(cause, "It needs parts built for the release's NumPy: install another release.") from error
    try:
        picam2 = Picamera2(index)
    except RuntimeError as error:
        raise CameraError(f"Camera {index} cannot be opened: {error}.", CABLE_REMEDY) from error
    try:
        return RawMonoCamera(picam2, mode=mode, exposure_us=exposure_us, gain=gain, frame_rate_hz=frame_rate_hz)
    except (CameraError, InvalidQuantity):
        picam2.close()
        raise


class RawMonoCamera:
    """A monochrome camera with fixed exposure, gain and frame rate. Implements `Camera`."""

    def __init__(
        self,
        picam2: Picamera2,
        *,
        mode: RawMode,
        exposure_us: int,
        gain: float,
        frame_rate_hz: float,
    ) -> None:
        """Configure and start the stream; raise `CameraError` when the camera does not do exactly what is asked.

        Raises `InvalidQuantity` when the exposure (us) does not fit into one frame.
        """
        frame_us = round(1e6 / require("frame_rate_hz", frame_rate_hz, Bound(0.1, 1000.0, "Hz"), "set a frame rate"))
        longest = Bound(0.0, frame_us, "us", low_included=False)
        require("exposure_us", exposure_us, longest, "shorten the exposure or lower the frame rate")
        self._picam2 = picam2
        self._mode, self._exposure_us, self._gain = mode, exposure_us, gain
        controls: dict[str, Any] = {"ExposureTime": exposure_us, "AnalogueGain": gain}
        controls["FrameDurationLimits"] = (frame_us, frame_us)
        if "AeEnable" in picam2.camera_controls:
            controls["AeEnable"] = False
        self._controls, self._is_resting = controls, True
        try:
            self._stride_bytes = self._configure(controls)
        except RuntimeError as error:
            raise CameraError(f"Camera cannot be started: {error}.", CABLE_REMEDY) from error
        self._start()
        self._frames = RawFrames(mode)
        # Once for nothing: loading what scales a frame may take longer than the first frame may.
        self._frames.frame(np.zeros((mode.sensor_px[1], self._stride_bytes), np.uint8))

    def _start(self) -> None:
        """Start the stream as it was configured: picamera2 forgets its controls with each start."""
        try:
            self._picam2.set_controls(self._controls)
            self._picam2.start()
        except RuntimeError as error:
            raise CameraError(f"Camera cannot be started: {error}.", CABLE_REMEDY) from error
        self._is_resting = False

    def rest(self) -> None:
        """Stop the stream: sensor and image processor take no power until the next frame is asked for."""
        if not self._is_resting:
            self._picam2.stop()
            self._is_resting = True

    def _configure(self, controls: dict[str, Any]) -> int:
        """Configure the raw stream; return its rows' bytes, or raise `CameraError` when anything was adjusted."""
        size, raw_format = self._mode.sensor_px, self._mode.raw_format
        configuration = self._picam2.create_video_configuration(
            main={"size": size, "format": "YUV420"},  # libcamera insists on a processed stream beside the raw one
            raw={"size": size, "format": raw_format},
            controls=controls,
            buffer_count=BUFFER_COUNT,
            display=None,
            encode=None,
        )
        self._picam2.configure(configuration)
        raw = self._picam2.camera_configuration()["raw"] or {}
        self._refuse_adjustment("format", raw_format, raw.get("format"))
        self._refuse_adjustment("size", size, raw.get("size"))
        self._refuse_out_of_range(controls)
        return int(raw["stride"])

    def _refuse_adjustment(self, what: str, asked: object, given: object) -> None:
        if given != asked:
            cause = f"Camera gives {what} {given} instead of {asked}."
            raise CameraError(cause, f"Set a {what} that this camera has in the configuration.")

    def _refuse_out_of_range(self, controls: dict[str, Any]) -> None:
        """Refuse what libcamera would clamp in silence; the limits are those of the configured sensor mode."""
        for name, value in controls.items():
            low, high, _default = self._picam2.camera_controls[name]
            values = value if isinstance(value, tuple) else (value,)
            if not all(low <= number <= high for number in values):
                cause = f"Camera control {name} is set to {value}, but this camera takes {low} to {high}."
                raise CameraError(cause, "Change exposure, gain or frame rate in the configuration.")

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        """Return the next frame whose exposure began at or after `begun_after_s` (s, monotonic).

        Raises `CameraError` when none comes within `timeout_s`, or when it is of the wrong shape or type.
        """
        require("timeout_s", timeout_s, Bound(0.0, 3600.0, "s", low_included=False), "give the frame time to arrive")
        if self._is_resting:
            self._start()
        try:
            # A flush of 0 would mean "no flush" to picamera2.
            request = self._picam2.capture_request(flush=max(1, math.ceil(begun_after_s * 1e9)), wait=timeout_s)
        except TimeoutError as error:
            # Otherwise the abandoned job takes the next frame and never gives its buffer back.
            self._picam2.cancel_all_and_flush()
            raise CameraError(f"Camera gave no frame within {timeout_s:g} s.", CABLE_REMEDY) from error
        try:
            return self._frame(request)
        finally:
            request.release()

    def _frame(self, request: CompletedRequest) -> CameraFrame:
        metadata = request.get_metadata()
        exposure_us = float(metadata["ExposureTime"])
        # SensorTimestamp is the end of the exposure on CLOCK_BOOTTIME. It equals CLOCK_MONOTONIC, the clock of the
        # lights and the load cell, as long as the board was never suspended; the probe never is.
        exposure_start_s = metadata["SensorTimestamp"] * 1e-9 - exposure_us * 1e-6
        gain = float(metadata["AnalogueGain"])
        self._require_as_set(exposure_us, gain)
        rows = request.make_array("raw")
        self._require_rows(rows)
        # The buffer is reused: the counts are a copy.
        return CameraFrame(self._frames.frame(rows), exposure_start_s, exposure_us, gain)

    def _require_as_set(self, exposure_us: float, gain: float) -> None:
        """Refuse a frame that was not taken as it was asked for; the sensor's own steps are granted."""
        missed_us, missed_ratio = abs(exposure_us - self._exposure_us), abs(gain / self._gain - 1)
        if missed_us > EXPOSURE_STEP_US or missed_ratio > GAIN_STEP_RATIO:
            cause = (
                f"Camera exposed a frame for {exposure_us:g} us at gain {gain:g} "
                f"instead of {self._exposure_us} us at {self._gain:g}."
            )
            raise CameraError(cause, "Set an exposure and a gain that this camera has in the configuration.")

    def _require_rows(self, rows: NDArray[np.uint8]) -> None:
        expected = (self._mode.sensor_px[1], self._stride_bytes)
        if rows.shape != expected or rows.dtype != np.uint8:
            cause = f"Camera gave a frame of shape {rows.shape} and type {rows.dtype} instead of {expected} and uint8."
            raise CameraError(cause, CABLE_REMEDY)

    def close(self) -> None:
        """Stop the stream and give the camera back."""
        self._picam2.stop()
        self._picam2.close()


class RawFrames:
    """Makes frames of the rows of one mode, in memory that is taken once."""

    def __init__(self, mode: RawMode) -> None:
        self._mode = mode
        self._is_as_it_comes = mode.raw_format == "R8" and mode.crop_px == mode.frame_px
        self._per_count = np.float32(2.0 ** (8 - RAW_BITS[mode.raw_format]))
        self._light = self._scaled = np.empty((0, 0), np.float32)
        if not self._is_as_it_comes:
            self._light = self._scaled = np.empty(mode.crop_px[::-1], np.float32)
        if mode.crop_px != mode.frame_px:
            self._scaled = np.empty(mode.frame_px[::-1], np.float32)

    def frame(self, rows: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the counts [height_px, width_px] of a frame, a copy, from rows [sensor height, stride in bytes].

        The middle is cut out, and areas are averaged. A frame has 8 bits whatever the sensor has: more of them only
        make the mean over an area finer before it is rounded. Rows are padded at their end; unpacked formats of more
        than 8 bits have two bytes a pixel, the low one first, and their bits at the low end.
        Source: libcamera formats R8, R10, R12, R16; picamera2 0.3.38 (`helpers.make_array`).
        """
        counts = self._cropped(rows if self._mode.bytes_per_px == 1 else rows.view("<u2"))
        if self._is_as_it_comes:
            return np.array(counts, np.uint8)
        import cv2  # only a camera that converts has to load it

        np.multiply(counts, self._per_count, out=self._light)
        if self._scaled is not self._light:  # each pixel the mean of the area that it covers
            cv2.resize(self._light, self._mode.frame_px, dst=self._scaled, interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.convertScaleAbs(self._scaled), np.uint8)  # rounds, and ends at 255

    def _cropped(self, counts: NDArray[Any]) -> NDArray[Any]:
        (x, y), (width, height) = self._mode.crop_from_px, self._mode.crop_px
        return counts[y : y + height, x : x + width]
