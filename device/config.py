"""All settings of the daemon by section: each with its type, default, unit, range and one sentence, as data.

Out-of-range values are refused, never clipped. Paths are relative to where the daemon is started. docs/settings.md is
made from here; which files are read, and in which order, is in device/settings/layers.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from device.measurement.mode import Mode
from device.measurement.quantities import Bound
from device.settings.camera_section import CameraSection
from device.settings.cell_section import CellSection
from device.settings.light_section import LightSection
from device.settings.press_section import PressSection
from device.settings.setting import Conflict, Section, setting

MODELS = Path(__file__).resolve().parents[1] / "models"
SIMULATED_PROBE = MODELS / "simulated_probe"


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
