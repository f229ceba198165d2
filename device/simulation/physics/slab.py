"""The patient's tissue under the probe: a slab's modulus and thickness, and how stiff an inclusion is against it.

What an inclusion adds to the face depends on its elastic mismatch with the tissue, not on its modulus alone: for an
incompressible sphere it is (E - Et) / (E + 3/2 Et), in which the field is all but linear; 0 for tissue, 1 for a rigid
sphere. Source: Eshelby, Proc. R. Soc. A 241 (1957), on the mismatch.
"""

from __future__ import annotations

from dataclasses import dataclass

from device.measurement.parameters import ABOVE_BASE_MM, modulus_ratio
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require

PEOPLES_KPA, PEOPLES_MM = (2.0, 30.0), (15.0, 60.0)
"""Fat and gland of the breast, over bone and in its middle: 3 kPa in samples (Samani et al., Phys. Med. Biol. 52,
2007), 2-3 kPa by magnetic resonance, 11 +- 6 kPa by shear waves."""
NEAR_KPA, NEAR_MM = (4.0, 6.25), (27.0, 36.0)
"""Around the nominal slab: what was solved in it alone is added as it is to a press in these."""


@dataclass(frozen=True)
class Slab:
    """Homogeneous tissue on a rigid base: Young's modulus Et (2-30 kPa) and thickness (15-60 mm).

    Raises `InvalidQuantity` outside these ranges, which are the virtual probe's tables'.
    """

    youngs_modulus_kpa: float = 5.0
    thickness_mm: float = 30.0

    def __post_init__(self) -> None:
        action = "choose tissue inside the range of the virtual probe's tables"
        require("tissue_modulus_kpa", self.youngs_modulus_kpa, Bound(*PEOPLES_KPA, "kPa"), action)
        require("slab_thickness_mm", self.thickness_mm, Bound(*PEOPLES_MM, "mm"), action)

    def elastic_mismatch(self, youngs_modulus_kpa: float) -> float:
        """Return an inclusion's mismatch in this slab, (E - Et) / (E + 3/2 Et)."""
        return (youngs_modulus_kpa - self.youngs_modulus_kpa) / (youngs_modulus_kpa + 1.5 * self.youngs_modulus_kpa)

    def modulus_kpa(self, mismatch: float) -> float:
        """Return the Young's modulus of an inclusion of a mismatch below 1 in this slab."""
        return self.youngs_modulus_kpa * modulus_ratio(mismatch)

    def require_held(self, inclusion: Inclusion) -> None:
        """Refuse an inclusion that touches the slab's base, or all but does."""
        lowest_mm = inclusion.depth_mm + inclusion.size_mm
        action = "choose a smaller or shallower inclusion, or a thicker slab"
        require("depth_mm + size_mm", lowest_mm, Bound(0.0, self.thickness_mm - ABOVE_BASE_MM, "mm"), action)

    def require_near_nominal(self, quantity: str) -> None:
        """Refuse what is known in the nominal slab only, where this one is far from it."""
        stated = self.stated
        near = zip((stated.youngs_modulus_kpa, stated.thickness_mm), (NEAR_KPA, NEAR_MM), strict=True)
        if not all(low <= value <= high for value, (low, high) in near):
            tissue = f"given in tissue of {stated.youngs_modulus_kpa:g} kPa, {stated.thickness_mm:g} mm thick"
            (softest, firmest), (thinnest, thickest) = NEAR_KPA, NEAR_MM
            bound = f"absent but in {softest:g}-{firmest:g} kPa and {thinnest:g}-{thickest:g} mm"
            raise InvalidQuantity(quantity, tissue, bound, "choose such tissue, or leave it away")

    @property
    def stated(self) -> Slab:
        """The slab whose inclusions a table is asked for."""
        return self

    def changed(self, modulus_ratio: float) -> Slab:
        """Return the slab where its tissue is so much stiffer or softer, with the inclusions of this one.

        Raises `InvalidQuantity` where that is not tissue that the tables hold.
        """
        if modulus_ratio == 1.0:
            return self
        return ChangedSlab(self.youngs_modulus_kpa * modulus_ratio, self.thickness_mm, self)


NOMINAL = Slab()


@dataclass(frozen=True)
class ChangedSlab(Slab):
    """Tissue softer or stiffer than that of the slab it is part of, whose inclusions it may hold."""

    part_of: Slab = NOMINAL

    @property
    def stated(self) -> Slab:
        """The slab that it is part of."""
        return self.part_of
