"""The daemon's settings by section: each with its type, default, unit, range and one sentence, as data.

Out-of-range values are refused, never clipped. Paths are relative to where the daemon is started. docs/settings.md is
made from here; which files are read, and in which order, is in device/settings/layers.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Literal, get_args

from device.hardware.raw_mode import RAW_BITS, RawFormat, RawMode
from device.measurement.mode import MODES, RAMP_FROM_N, RAMP_TO_N, Mode
from device.measurement.quantities import Bound
from device.measurement.tactile_image import PixelScale
from device.settings.light_section import LightSection
from device.settings.setting import Conflict, Section, conflict, setting

MODELS = Path(__file__).resolve().parents[1] / "models"
SIMULATED_PROBE = MODELS / "simulated_probe"
CellProtocol = Literal["openscale", "mantracourt"]


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


@dataclass(frozen=True)
class CellSection(Section):
    """The load cell: its serial line, its sensitivity, and what it bears."""

    prefix = "cell."

    device: str = setting("/dev/tsis-force", "Serial line of the load cell's amplifier.")
    baud: int = setting(115_200, "Speed of the serial line.", Bound(300, 4_000_000, "baud"))
    protocol: CellProtocol = setting(
        "openscale",
        "What the load cell's amplifier speaks; a mantracourt has a station, and a count of 1 nV/V.",
        choices=get_args(CellProtocol),
    )
    station: int = setting(1, "Station number of a mantracourt.", Bound(1, 999, ""))
    sensitivity_counts_per_n: float = setting(
        100_000.0, "Change of the amplifier's reading by one newton.", Bound(1.0, 1e7, "counts/N")
    )
    tare_spread_n: float = setting(
        0.02, "Readings that spread more than this while taring are not of an untouched probe.", Bound(0.0001, 1.0, "N")
    )
    commissioned_tare_counts: float | None = setting(
        None,
        "Reading of the free probe at commissioning; without it that of each start stands in.",
        Bound(-(2.0**23), 2.0**23, "counts"),
    )
    tare_drift_n: float = setting(
        0.2, "How far from the commissioning tare the tare of a start may be.", Bound(0.01, 5.0, "N")
    )
    max_load_n: float = setting(5.0, "Load, from the commissioning tare, that is an overload.", Bound(1.0, 100.0, "N"))


@dataclass(frozen=True)
class PressSection(Section):
    """The press: mode unless asked otherwise, target force and its band, what is contact, steady, and too much."""

    prefix = "press."

    mode: Mode = setting("paper", "How a press is measured unless it is asked for in another mode.", choices=MODES)
    target_n: float = setting(0.5, "Force of a hold.", Bound(0.1, 20.0, "N"))
    band_ratio: float = setting(
        0.05, "Frames of a hold are taken this near to the target, as a part of it.", Bound(0.005, 0.2, "")
    )
    contact_n: float = setting(
        0.05, "Force that is contact, at most half the target.", Bound(0.005, 0.75 * RAMP_FROM_N, "N")
    )
    steady_n: float = setting(0.02, "Change of force within which a hold is steady.", Bound(0.001, 1.0, "N"))
    overload_n: float = setting(
        1.0, "Force that is too much, at least a fifth above the target.", Bound(1.2 * RAMP_TO_N, 50.0, "N")
    )
    max_rate_n_per_s: float = setting(
        0.35,
        "A ramp's force may not change faster, or it would not be known at the exposure.",
        Bound(0.05, 5.0, "N/s"),
    )
    max_offset_mm: float = setting(
        2.5,
        "A lump whose bright spot lies further off the middle of the face is off-centre: the press is rejected.",
        Bound(0.5, 30.0, "mm"),
    )
    timeout_s: float = setting(60.0, "A press that takes longer is given up.", Bound(1.0, 3600.0, "s"))

    def conflicts(self) -> Iterator[Conflict]:
        """Yield a contact that is too near to the target from below, and an overload from above."""
        contact = Bound(0.005, self.target_n / 2, "N, half the target")
        yield from conflict("press.contact_n", self.contact_n, contact, "press.target_n")
        overload = Bound(1.2 * self.target_n, 50.0, "N, a fifth above the target")
        yield from conflict("press.overload_n", self.overload_n, overload, "press.target_n")

    @property
    def band_n(self) -> tuple[float, float]:
        """Forces between which frames are taken."""
        return self.target_n * (1 - self.band_ratio), self.target_n * (1 + self.band_ratio)


@dataclass(frozen=True)
class StoreSection(Section):
    """The disk: how much must be left before a press is taken."""

    prefix = "store."

    min_free_mb: float = setting(50.0, "Space that must be left before a press is taken.", Bound(1.0, 1e6, "MB"))


@dataclass(frozen=True)
class ClockSection(Section):
    """The wall clock: by how much it may be set before `taken_at` is doubted."""

    prefix = "clock."

    max_jump_s: float = setting(
        2.0, "The clock may be set by so much before the time of a press is doubted.", Bound(0.1, 3600.0, "s")
    )


@dataclass(frozen=True)
class ServerSection(Section):
    """Where the screen and the REST API are served; loopback unless told otherwise."""

    prefix = "server."

    host: str = setting("127.0.0.1", "Address at which screen and REST API are served; 0.0.0.0 serves the network.")
    port: int = setting(8000, "Port of screen and REST API; 0 takes any free one.", Bound(0, 65535, ""))


@dataclass(frozen=True)
class Config(Section):
    """All settings of the daemon."""

    serial: str = setting("TSIS-0000", "Serial number of this probe; model and certificate are for it.")
    model: Path = setting(MODELS / "paper", "Folder of the model that answers in mode paper.")
    quick_model: Path = setting(
        MODELS / "quick", "Folder of the model of mode quick, offered where it is installed and for this probe."
    )
    profile_model: Path = setting(
        MODELS / "standard",
        "Folder of the model of modes standard and precise, offered where it is installed and for this probe.",
    )
    calibration: Path = setting(
        Path("/var/lib/tsis/calibrations"),
        "Folder of this probe's certificates, of which one is active; or one certificate, NAME.json.",
    )
    data: Path = setting(Path("/var/lib/tsis"), "Folder of measurements and recordings.")
    camera: CameraSection = field(default_factory=CameraSection)
    light: LightSection = field(default_factory=LightSection)
    cell: CellSection = field(default_factory=CellSection)
    press: PressSection = field(default_factory=PressSection)
    store: StoreSection = field(default_factory=StoreSection)
    clock: ClockSection = field(default_factory=ClockSection)
    server: ServerSection = field(default_factory=ServerSection)

    def conflicts(self) -> Iterator[Conflict]:
        """Yield an exposure that the light does not allow, and a chip that has the bus and address of another."""
        yield from self.light.exposure_conflicts(self.camera.exposure_us, 1e6 / self.camera.frame_rate_hz)
        chips = {name: part for name, part in vars(self).items() if hasattr(part, "chip_address")}
        for (other, theirs), (name, ours) in combinations(chips.items(), 2):
            if (ours.bus, ours.chip_address) == (theirs.bus, theirs.chip_address):
                bound = f"another than that of {other} on the same bus"
                yield Conflict(f"{name}.address", hex(ours.chip_address), bound, (f"{other}.address",))


SIMULATED: dict[str, tuple[str, Mode]] = {
    "SIM-0001": ("calibration.json", "standard"),
    "SIM-LINEAR": ("calibration_linear.json", "paper"),
}
"""Certificate and mode of each simulated probe."""


def simulated_config(serial: str = "SIM-0001") -> Config:
    """Return the settings of a simulated probe: its certificate, mode and data folder. Each kind of light has a serial.

    Only the paper's regressions can be had for the paper's light.
    """
    certificate, mode = SIMULATED.get(serial, SIMULATED["SIM-0001"])
    calibration = SIMULATED_PROBE / certificate
    return Config(serial=serial, calibration=calibration, data=Path("var"), press=PressSection(mode=mode))
