"""A recording: the frames of one press or scan, how they were taken and where they came from.

What probe, simulator, calibration and tests pass to each other; what is not finite or contradictory is refused with the
field's name. Its file is in device/files/recording_file.py. Source: docs/contracts.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Literal

from device.measurement.mode import Mode
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from device.measurement.recording.camera_geometry import CameraGeometry
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Frame, TactileImage, reference, require_one_shape, tactile_image

REPAIR = "record the press again, or correct the file"
GEOMETRY = ("axis_x_mm", "axis_y_mm", "rim_distortion_percent")
"""What a recording says of its camera only where the camera is not ideal; absent, each is 0."""


@dataclass(frozen=True)
class CameraSettings:
    """How the frames were taken; the last three are those of `CameraGeometry`."""

    width_px: int
    height_px: int
    bits: Literal[8, 16]
    mm_per_px_x: float
    mm_per_px_y: float
    exposure_us: float
    gain: float
    axis_x_mm: float = 0.0
    axis_y_mm: float = 0.0
    rim_distortion_percent: float = 0.0

    def __post_init__(self) -> None:
        for name in ("width_px", "height_px"):
            require(f"camera.{name}", getattr(self, name), Bound(16, 10_000, "px"), REPAIR)
        if self.bits not in (8, 16):
            raise InvalidQuantity("camera.bits", self.bits, "8 or 16", REPAIR)
        require("camera.exposure_us", self.exposure_us, Bound(0.0, 1e7, "us", low_included=False), REPAIR)
        require("camera.gain", self.gain, Bound(0.0, 1e3, "", low_included=False), REPAIR)
        self.geometry  # noqa: B018 - refuses an impossible pixel size, axis or distortion

    @property
    def scale(self) -> PixelScale:
        """Size of a pixel on the face."""
        return PixelScale(self.mm_per_px_x, self.mm_per_px_y)

    @property
    def geometry(self) -> CameraGeometry:
        """Where on the face the pixels look."""
        return CameraGeometry(self.scale, self.axis_x_mm, self.axis_y_mm, self.rim_distortion_percent)

    def seen_as(self, geometry: CameraGeometry) -> CameraSettings:
        """Return the settings of the same frames where another geometry is known of their camera."""
        told = {name: getattr(geometry, name) for name in GEOMETRY}
        return replace(self, **asdict(geometry.scale), **told)

    def as_record(self) -> dict[str, float]:
        """Return the settings as a JSON object; axis and distortion only where one of them is not 0."""
        record = asdict(self)
        return {name: value for name, value in record.items() if name not in GEOMETRY or not self.geometry.is_ideal}


@dataclass(frozen=True)
class RecordedCell:
    """How the load cell's counts became the forces: slope, and reading of the free probe at commissioning if known."""

    counts_per_n: float
    tare_counts: float | None = None

    def __post_init__(self) -> None:
        bound = Bound(0.0, 1e9, "counts/N", low_included=False)
        require("cell.counts_per_n", self.counts_per_n, bound, REPAIR)
        if self.tare_counts is not None:
            require("cell.tare_counts", self.tare_counts, Bound(-1e12, 1e12, "counts"), REPAIR)


@dataclass(frozen=True)
class Recording:
    """One press or scan: frames of every role with their force, and where it came from.

    `truth` only for phantoms, `phantom_serial` that of their set if it is known; `mode` in which it was answered, None
    where nobody said.
    """

    id: str
    serial: str
    software: str
    started_at: str
    camera: CameraSettings
    frames: tuple[Frame, ...]
    calibration_id: str | None = None
    position_mm: tuple[float, float] = (0.0, 0.0)
    truth: Inclusion | None = None
    simulated: bool = False
    cell: RecordedCell | None = None
    phantom_serial: str = ""
    mode: Mode | None = None

    def __post_init__(self) -> None:
        require_one_shape(self.frames)
        for frame in self.frames:
            shape, expected = frame.counts.shape, (self.camera.height_px, self.camera.width_px)
            if shape != expected:
                found = f"{shape[1]} x {shape[0]} px"
                raise InvalidQuantity("frame shape", found, f"{expected[1]} x {expected[0]} px as in camera", REPAIR)
            bits = 8 * frame.counts.itemsize
            if bits != self.camera.bits:
                raise InvalidQuantity("camera.bits", self.camera.bits, f"{bits} as the frames have", REPAIR)

    def with_role(self, role: str) -> list[Frame]:
        """Return the frames of one role in order."""
        return [f for f in self.frames if f.role == role]

    def ramps(self) -> dict[int, list[Frame]]:
        """Return the press frames of each ramp in order, by its number; {} without press frames."""
        press = self.with_role("press")
        return {ramp: [f for f in press if f.ramp == ramp] for ramp in sorted({f.ramp for f in press})}

    def of_ramp(self, ramp: int) -> Recording:
        """Return the recording that there were if this ramp were the only press on the lesion."""
        kept = (f for f in self.frames if f.role != "press" or f.ramp == ramp)
        return replace(self, frames=tuple(replace(f, ramp=0) if f.ramp else f for f in kept))

    def press_images(self) -> Iterator[TactileImage]:
        """Yield the corrected image of each press frame."""
        base = reference(self.frames)
        return (tactile_image(frame, base, self.camera.scale) for frame in self.with_role("press"))
