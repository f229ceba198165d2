"""Named sets of phantoms to record: inclusions whose truth is published, and random ones.

Source of the eight: Egorov & Sarvazyan, IEEE Trans. Medical Imaging 27 (2008), table II: models 35 mm thick of 5 kPa,
spheres at 10 mm depth. They are solved each on its own, since the table is of other sizes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from device.measurement.quantities import Inclusion
from device.simulation.physics.surface_table import PressRamps
from device.simulation.scenario import NO_INCLUSION, Scenario
from host_tools.probe_tables.force_ramps import press_ramps
from host_tools.scenes.phantom_set import PhantomSet
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Scene, Tissue

BREAST_IMAGER_SIZE_KPA = ((5, 20), (5, 80), (10, 10), (10, 40), (14, 40), (14, 156), (18, 20), (18, 80))
BREAST_IMAGER_DEPTH_MM, BREAST_IMAGER_SLAB_MM = 10.0, 35.0
SMALLEST_RANDOM_MM = 2.0


@dataclass(frozen=True)
class Phantom:
    """One phantom by name, a bare block where its inclusion is of 0 mm; in its own `tissue`, or in the scenario's.

    `scene` only where the table of the virtual probe does not hold it, `set_serial` only of a set that has one.
    """

    name: str
    inclusion: Inclusion
    scene: Scene | None = None
    tissue: Tissue | None = None
    set_serial: str = ""

    def ramps(self) -> PressRamps | None:
        """Return how the face deforms, solved for this phantom alone, or None where the table says it."""
        return press_ramps(self.scene) if self.scene else None

    @property
    def truth(self) -> Inclusion | None:
        """Its inclusion, None in a bare block."""
        return self.inclusion if self.inclusion.size_mm else None

    def in_its_tissue(self, scenario: Scenario) -> Scenario:
        """Return a scenario on its tissue; raise `InvalidQuantity` for one that the tables do not hold with it."""
        if self.tissue is None:
            return scenario
        modulus_kpa, thickness_mm = self.tissue.youngs_modulus_kpa, self.tissue.thickness_mm
        in_tissue = replace(scenario, tissue_modulus_kpa=modulus_kpa, slab_thickness_mm=thickness_mm)
        in_tissue.slab.require_held(self.inclusion)
        return in_tissue


def of_file(phantoms: PhantomSet) -> Iterator[Phantom]:
    """Yield the phantoms of a file, bare blocks among them, each in its tissue."""
    for one in phantoms.phantoms:
        yield Phantom(one.name, one.inclusion or NO_INCLUSION, tissue=one.tissue, set_serial=phantoms.serial)


def breast_imager() -> Iterator[Phantom]:
    """Yield the eight published inclusions of the Breast Mechanical Imager."""
    tissue = replace(Tissue(), thickness_mm=BREAST_IMAGER_SLAB_MM)
    for number, (size_mm, modulus_kpa) in enumerate(BREAST_IMAGER_SIZE_KPA, start=1):
        inclusion = Inclusion(float(size_mm), BREAST_IMAGER_DEPTH_MM, float(modulus_kpa))
        yield Phantom(f"breast_imager{number}", inclusion, Scene(inclusion, tissue=tissue))


def random_set(count: int, seed: int) -> Iterator[Phantom]:
    """Yield phantoms drawn evenly from the paper's box, no smaller than 2 mm."""
    low = (SMALLEST_RANDOM_MM, *PAPER_BOX_LOW[1:])
    for number, row in enumerate(np.random.default_rng(seed).uniform(low, PAPER_BOX_HIGH, (count, 3)), start=1):
        yield Phantom(f"random{number:03d}", Inclusion(*map(float, row)))
