"""The settings of the camera: the frames the probe works on, and the mode of the sensor that they are made of.

A frame may be made of a larger mode: of its middle, each pixel the mean over an area (device/hardware/camera.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from device.hardware.raw_mode import RAW_BITS, RawFormat, RawMode
from device.measurement.quantities import Bound
from device.measurement.recording.pixel_scale import PixelScale
from device.settings.setting import Conflict, Section, conflict, setting


@dataclass(frozen=True)
class CameraSection(Section):
    """The camera: frame size, pixel size on the face, fixed exposure and gain, frame rate.

    A frame may be made of a larger mode of the sensor: of its middle, each pixel the mean over an area.
    """

    prefix = "camera."

    width_px: int = setting(768, "Columns of a frame.", Bound(64, 4096, "px"))
    height_px: int = setting(492, "Rows of a frame.", Bound(64, 4096, "px"))
    mm_per_px_x: float = setting(0.03125, "Width of a frame's pixel on the sensing face.", Bound(1e-4, 1.0, "mm"))
    mm_per_px_y: float = setting(0.03646, "Height of a frame's pixel on the sensing face.", Bound(1e-4, 1.0, "mm"))
    raw_format: RawFormat = setting(
        "R8", "Unpacked raw format of the sensor; frames have 8 bits all the same.", choices=tuple(RAW_BITS)
    )
    sensor_width_px: int | None = setting(
        None, "Columns of the sensor's mode; those of a frame unless given.", Bound(64, 8192, "px")
    )
    sensor_height_px: int | None = setting(
        None, "Rows of the sensor's mode; those of a frame unless given.", Bound(64, 8192, "px")
    )
    crop_width_px: int | None = setting(
        None, "Columns in the sensor's middle that a frame is made of; all unless given.", Bound(64, 8192, "px")
    )
    crop_height_px: int | None = setting(
        None, "Rows in the sensor's middle that a frame is made of; all unless given.", Bound(64, 8192, "px")
    )
    exposure_us: int = setting(4000, "Exposure time of every frame, at most one frame long.", Bound(10, 1e6, "us"))
    gain: float = setting(1.0, "Analogue gain of every frame.", Bound(1.0, 16.0, ""))
    frame_rate_hz: float = setting(30.0, "Frames a second.", Bound(1.0, 240.0, "Hz"))
    index: int = setting(0, "Number of the camera on this board.", Bound(0, 99, ""))
    max_restarts: int = setting(
        5, "How often in a minute the camera's process, when it hung or died, is started again.", Bound(0, 100, "")
    )
    late_frames: float = setting(
        3.0, "A frame begun this long after it was asked for is late.", Bound(1.5, 100.0, "frame times")
    )
    tear_counts: float = setting(
        10.0,
        "A step between two rows, compared with the frame before, above which one of the two frames is torn.",
        Bound(0.5, 255.0, "counts"),
    )

    def conflicts(self) -> Iterator[Conflict]:
        """Yield an exposure longer than a frame, and a part of the sensor that is not on it or less than a frame."""
        bound = Bound(10, 1e6 / self.frame_rate_hz, "us, one frame")
        yield from conflict("camera.exposure_us", self.exposure_us, bound, "camera.frame_rate_hz")
        mode = self.raw_mode
        for number, side in enumerate(("width_px", "height_px")):
            sensor_px, crop_px, frame_px = mode.sensor_px[number], mode.crop_px[number], mode.frame_px[number]
            sensor, crop, frame = f"camera.sensor_{side}", f"camera.crop_{side}", f"camera.{side}"
            too_small = [*conflict(sensor, sensor_px, Bound(frame_px, 8192, "px, a frame's or more"), frame)]
            within = Bound(frame_px, sensor_px, "px, from a frame's to the sensor's")
            yield from too_small or conflict(crop, crop_px, within, frame, sensor)

    @property
    def scale(self) -> PixelScale:
        """Size of a frame's pixel on the face."""
        return PixelScale(self.mm_per_px_x, self.mm_per_px_y)

    @property
    def sensor_scale(self) -> PixelScale:
        """Size of a sensor's pixel on the face."""
        (crop_x, crop_y), (width, height) = self.raw_mode.crop_px, self.raw_mode.frame_px
        return PixelScale(self.mm_per_px_x * width / crop_x, self.mm_per_px_y * height / crop_y)

    @property
    def raw_mode(self) -> RawMode:
        """The sensor's mode and what a frame is made of."""
        frame_px = (self.width_px, self.height_px)
        sensor_px = (self.sensor_width_px or self.width_px, self.sensor_height_px or self.height_px)
        crop_px = (self.crop_width_px or sensor_px[0], self.crop_height_px or sensor_px[1])
        return RawMode(sensor_px, crop_px, frame_px, self.raw_format)
