"""A scenario: which inclusion the virtual probe is pressed on, by which hand, seen by which camera. A TOML file.

Every number has its unit in its name; a key that is not known is refused, never ignored.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from device.files.toml_record import read_toml
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from device.simulation.faults import ScriptedFault
from device.simulation.grid_target import GridTarget
from device.simulation.hand import HandSettings
from device.simulation.physics.image_formation import LinearOptics
from device.simulation.physics.lens import Lens
from device.simulation.physics.neighbour import Neighbour
from device.simulation.physics.sensor import Sensor
from device.simulation.physics.skin import Skin
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import AS_BELIEVED, World

SERIALS = {"physical": "SIM-0001", "linear": "SIM-LINEAR"}
DEFAULT_INCLUSION = Inclusion(size_mm=12.0, depth_mm=6.0, youngs_modulus_kpa=60.0)

NO_INCLUSION = Inclusion(size_mm=0.0, depth_mm=5.0, youngs_modulus_kpa=80.0)
"""What stands for the inclusion of a bare block, wherever one must be named."""


@dataclass(frozen=True)
class CellSettings:
    """The emulated load cell: counts per newton, counts at no load, noise of one sample, drift of the zero, and how
    many readings a second its amplifier streams."""

    counts_per_n: float = 100_000.0
    zero_counts: float = 8_200.0
    noise_counts: float = 40.0
    drift_counts_per_s: float = 0.0
    rate_hz: float = 80.0

    def __post_init__(self) -> None:
        action = "use a real cell's data sheet"
        require("cell.counts_per_n", self.counts_per_n, Bound(1.0, 1e7, "counts/N"), action)
        require("cell.zero_counts", self.zero_counts, Bound(-8e6, 8e6, "counts"), action)
        require("cell.noise_counts", self.noise_counts, Bound(0.0, 1e6, "counts"), action)
        require("cell.drift_counts_per_s", self.drift_counts_per_s, Bound(-1e4, 1e4, "counts/s"), action)
        require("cell.rate_hz", self.rate_hz, Bound(1.0, 1000.0, "Hz"), action)


@dataclass(frozen=True)
class Scenario:
    """What the virtual probe is made of and pressed on, what goes wrong, and how the device must tell.

    An inclusion of 0 mm is none; a `neighbour` is a second one beside it. The tissue is a slab of 2-30 kPa, 15-60 mm.
    `expects` is the fault code it must raise, `self_test_fails` the check of its self-test that must fail.
    `light` is "physical" (skin, lens and the table of light) or "linear" (the paper's assumption, `optics`).
    On a `grid`, a printed plate in a cap, there is nothing else to press on.
    `world` is what probe and presses are where that is not what skin, lens, cell and tables say.
    `settings` are those of the daemon, as in its file, that the scene needs otherwise than they are.
    """

    inclusion: Inclusion = DEFAULT_INCLUSION
    hand: HandSettings = field(default_factory=HandSettings)
    light: str = "physical"
    skin: Skin = field(default_factory=Skin)
    lens: Lens = field(default_factory=Lens)
    optics: LinearOptics = field(default_factory=LinearOptics)
    sensor: Sensor = field(default_factory=Sensor)
    cell: CellSettings = field(default_factory=CellSettings)
    tissue_modulus_kpa: float = 5.0
    slab_thickness_mm: float = 30.0
    seed: int = 1
    neighbour: Neighbour | None = None
    world: World = AS_BELIEVED
    grid: GridTarget | None = None
    faults: tuple[ScriptedFault, ...] = ()
    settings: dict[str, Any] = field(default_factory=dict)
    expects: str = ""
    self_test_fails: str = ""

    def __post_init__(self) -> None:
        if self.light not in SERIALS:
            raise InvalidQuantity("light", repr(self.light), "physical or linear", "choose one of them")
        if self.light == "linear" and self.world != AS_BELIEVED:
            raise InvalidQuantity("world", "given", "absent with linear light", "remove it, or take physical light")
        if self.light == "linear" and self.grid:
            raise InvalidQuantity("grid", "given", "absent with linear light", "remove it, or take physical light")
        _ = self.slab  # refuses tissue that the tables do not hold
        _ = self.world.lesion.skin(self.skin, 1.0)  # refuses an albedo above 1
        require("seed", self.seed, Bound(0, 2**63, ""), "give a whole number from 0")

    def on(
        self,
        inclusion: Inclusion | None,
        *,
        is_grid: bool = False,
        tissue_kpa_mm: tuple[float, float] | None = None,
    ) -> Scenario:
        """Return the scene pressed on an inclusion, on a block without one, or on its grid target.

        `tissue_kpa_mm` are modulus and thickness of the slab, the scene's unless given; raises `InvalidQuantity` for
        tissue that the tables do not hold.
        """
        grid = (self.grid or GridTarget()) if is_grid else None
        modulus_kpa, thickness_mm = tissue_kpa_mm or (self.tissue_modulus_kpa, self.slab_thickness_mm)
        return replace(
            self,
            inclusion=inclusion or NO_INCLUSION,
            grid=grid,
            tissue_modulus_kpa=modulus_kpa,
            slab_thickness_mm=thickness_mm,
        )

    @property
    def slab(self) -> Slab:
        """The tissue that is pressed; raises `InvalidQuantity` where the tables do not hold it."""
        return Slab(self.tissue_modulus_kpa, self.slab_thickness_mm)

    @property
    def serial(self) -> str:
        """Serial number of the virtual probe: one a light, since a calibration holds for one of them only."""
        return SERIALS[self.light]


def read_scenario(path: Path) -> Scenario:
    """Read a scenario file; raise `InvalidQuantity` naming the key and its bound."""
    return read_toml(Scenario, path)
