"""The daemon's settings: each with default, bound, unit in its name, and one sentence. Read once, from one TOML file.

Out-of-range values are refused, never clipped. Paths are relative to where the daemon is started.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from device.errors import ConfigError
from device.measurement.mode import MODES, RAMP_FROM_N, RAMP_TO_N, Mode
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.tactile_image import PixelScale
from device.measurement.toml_record import read_toml

MODELS = Path(__file__).resolve().parents[1] / "models"
ACTION = "correct the setting"


@dataclass(frozen=True)
class CameraSection:
    """The camera: frame size, pixel size on the face, fixed exposure and gain, frame rate.

    `late_frames`: a frame begun more frame times than this after it was asked for is late.
    `tear_counts`: a step between two rows, compared with the frame before, above which one of the two is torn.
    """

    width_px: int = 768
    height_px: int = 492
    mm_per_px_x: float = 0.03125
    mm_per_px_y: float = 0.03646
    exposure_us: int = 4000
    gain: float = 1.0
    frame_rate_hz: float = 30.0
    index: int = 0
    late_frames: float = 3.0
    tear_counts: float = 10.0

    def __post_init__(self) -> None:
        require("camera.width_px", self.width_px, Bound(64, 4096, "px"), ACTION)
        require("camera.height_px", self.height_px, Bound(64, 4096, "px"), ACTION)
        require("camera.frame_rate_hz", self.frame_rate_hz, Bound(1.0, 240.0, "Hz"), ACTION)
        frame_us = 1e6 / self.frame_rate_hz
        require("camera.exposure_us", self.exposure_us, Bound(10.0, frame_us, "us, one frame"), ACTION)
        require("camera.gain", self.gain, Bound(1.0, 16.0, ""), ACTION)
        require("camera.late_frames", self.late_frames, Bound(1.5, 100.0, "frame times"), ACTION)
        require("camera.tear_counts", self.tear_counts, Bound(0.5, 255.0, "counts"), ACTION)
        self.scale  # noqa: B018 - refuses an impossible pixel size

    @property
    def scale(self) -> PixelScale:
        """Size of a pixel on the face."""
        return PixelScale(self.mm_per_px_x, self.mm_per_px_y)


@dataclass(frozen=True)
class LightSection:
    """The LED driver: I2C bus and address, the brightness of the four sides while measuring, and when light is right.

    `max_dark_counts`: mean of a frame without light, black level included, above which something shines.
    `min_side_ratio`: a side that alone gives less than this part of the brightest one's light is dark.
    `max_dimming_ratio`: loss of a side's light, against commissioning or the first presses, that is warned of.
    `commissioned_counts`: mean counts above dark at the target force of each side alone at full brightness.
    `min_contrast_ratio`: how much of a press's light must have come with the force; gel and sweat leave less.
    """

    bus: int = 1
    address: int = 0x60
    ratio: tuple[float, ...] = (0.6, 0.6, 0.6, 0.6)
    max_dark_counts: float = 12.0
    min_side_ratio: float = 0.3
    max_dimming_ratio: float = 0.07
    commissioned_counts: tuple[float, ...] | None = None
    min_contrast_ratio: float = 0.3

    def __post_init__(self) -> None:
        require("light.address", self.address, Bound(0x08, 0x77, ""), ACTION)
        if len(self.ratio) != 4:
            raise InvalidQuantity("light.ratio", self.ratio, "four numbers, one a side", ACTION)
        for value in self.ratio:
            require("light.ratio", value, Bound(0.0, 1.0, "", low_included=False), ACTION)
        require("light.max_dark_counts", self.max_dark_counts, Bound(0.0, 100.0, "counts"), ACTION)
        require("light.min_side_ratio", self.min_side_ratio, Bound(0.01, 0.9, ""), ACTION)
        require("light.max_dimming_ratio", self.max_dimming_ratio, Bound(0.01, 0.9, ""), ACTION)
        require("light.min_contrast_ratio", self.min_contrast_ratio, Bound(0.01, 0.9, ""), ACTION)
        self._require_commissioned()

    def _require_commissioned(self) -> None:
        if self.commissioned_counts is None:
            return
        if len(self.commissioned_counts) != 4:
            raise InvalidQuantity("light.commissioned_counts", self.commissioned_counts, "four numbers", ACTION)
        for value in self.commissioned_counts:
            require("light.commissioned_counts", value, Bound(1.0, 255.0, "counts"), ACTION)


@dataclass(frozen=True)
class CellSection:
    """The load cell: its serial line and its sensitivity."""

    device: str = "/dev/tsis-force"
    baud: int = 115_200
    sensitivity_counts_per_n: float = 100_000.0
    tare_spread_n: float = 0.02

    def __post_init__(self) -> None:
        require("cell.baud", self.baud, Bound(300, 4_000_000, ""), ACTION)
        bound = Bound(1.0, 1e7, "counts/N")
        require("cell.sensitivity_counts_per_n", self.sensitivity_counts_per_n, bound, ACTION)
        require("cell.tare_spread_n", self.tare_spread_n, Bound(0.0001, 1.0, "N"), ACTION)


@dataclass(frozen=True)
class PressSection:
    """The press: mode unless asked otherwise, target force and its band, what is contact, steady, and too much.

    `max_rate_n_per_s`: a ramp's force may not change faster, or it would not be known at the exposure.
    """

    mode: Mode = "paper"
    target_n: float = 0.5
    band_ratio: float = 0.05
    contact_n: float = 0.05
    steady_n: float = 0.02
    overload_n: float = 1.0
    max_rate_n_per_s: float = 0.35
    timeout_s: float = 60.0

    def __post_init__(self) -> None:
        if self.mode not in MODES:
            raise InvalidQuantity("press.mode", repr(self.mode), f"one of {', '.join(MODES)}", ACTION)
        require("press.target_n", self.target_n, Bound(0.1, 20.0, "N"), ACTION)
        require("press.band_ratio", self.band_ratio, Bound(0.005, 0.2, ""), ACTION)
        highest_n = min(self.target_n / 2, 0.75 * RAMP_FROM_N)
        bound = Bound(0.005, highest_n, "N, half the target and below every ramp")
        require("press.contact_n", self.contact_n, bound, ACTION)
        require("press.steady_n", self.steady_n, Bound(0.001, 1.0, "N"), ACTION)
        lowest_n = 1.2 * max(self.target_n, RAMP_TO_N)
        require("press.overload_n", self.overload_n, Bound(lowest_n, 50.0, "N, a fifth above hold and ramp"), ACTION)
        require("press.max_rate_n_per_s", self.max_rate_n_per_s, Bound(0.05, 5.0, "N/s"), ACTION)
        require("press.timeout_s", self.timeout_s, Bound(1.0, 3600.0, "s"), ACTION)

    @property
    def band_n(self) -> tuple[float, float]:
        """Forces between which frames are taken."""
        return self.target_n * (1 - self.band_ratio), self.target_n * (1 + self.band_ratio)


@dataclass(frozen=True)
class StoreSection:
    """The disk: how much must be left before a press is taken."""

    min_free_mb: float = 50.0

    def __post_init__(self) -> None:
        require("store.min_free_mb", self.min_free_mb, Bound(1.0, 1e6, "MB"), ACTION)


@dataclass(frozen=True)
class ClockSection:
    """The wall clock: by how much it may be set before `taken_at` is doubted."""

    max_jump_s: float = 2.0

    def __post_init__(self) -> None:
        require("clock.max_jump_s", self.max_jump_s, Bound(0.1, 3600.0, "s"), ACTION)


@dataclass(frozen=True)
class ServerSection:
    """Where the screen and the REST API are served; loopback unless told otherwise."""

    host: str = "127.0.0.1"
    port: int = 8000

    def __post_init__(self) -> None:
        require("server.port", self.port, Bound(0, 65535, "(0: any free one)"), ACTION)


@dataclass(frozen=True)
class Config:
    """All settings of the daemon.

    `model` answers in mode paper; `quick_model` in quick and `profile_model` in standard and precise, where they are
    installed and for this probe.
    """

    serial: str = "TSIS-0000"
    model: Path = MODELS / "paper"
    quick_model: Path = MODELS / "quick"
    profile_model: Path = MODELS / "standard"
    calibration: Path = Path("/var/lib/tsis/calibration.json")
    data: Path = Path("/var/lib/tsis")
    camera: CameraSection = field(default_factory=CameraSection)
    light: LightSection = field(default_factory=LightSection)
    cell: CellSection = field(default_factory=CellSection)
    press: PressSection = field(default_factory=PressSection)
    store: StoreSection = field(default_factory=StoreSection)
    clock: ClockSection = field(default_factory=ClockSection)
    server: ServerSection = field(default_factory=ServerSection)


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
    calibration = MODELS / "simulated_probe" / certificate
    return Config(serial=serial, calibration=calibration, data=Path("var"), press=PressSection(mode=mode))


def read_config(path: Path) -> Config:
    """Read a configuration file; raise `ConfigError` naming the setting, its value and its bound."""
    try:
        return read_toml(Config, path)
    except InvalidQuantity as error:
        raise ConfigError(f"{path}: {error}", "Then start the daemon again.") from error
