"""The patient's tissue under the probe: a slab's modulus and thickness, and how stiff an inclusion is against it.

What an inclusion adds to the face depends on its elastic mismatch with the tissue, not on its modulus alone: for an
incompressible sphere it is (E - Et) / (E + 3/2 Et), in which the field is all but linear; 0 for tissue, 1 for a rigid
sphere. Source: Eshelby, Proc. R. Soc. A 241 (1957), on the mismatch.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from device.measurement.quantities import Bound, Inclusion, require


@dataclass(frozen=True)
class Slab:
    """Homogeneous tissue on a rigid base: Young's modulus Et (4-6.25 kPa) and thickness (27-36 mm).

    Raises `InvalidQuantity` outside these ranges, which are the virtual probe's tables'.
    """

    youngs_modulus_kpa: float = 5.0
    thickness_mm: float = 30.0

    def __post_init__(self) -> None:
        action = "choose tissue inside the range of the virtual probe's tables"
        require("tissue_modulus_kpa", self.youngs_modulus_kpa, Bound(4.0, 6.25, "kPa"), action)
        require("slab_thickness_mm", self.thickness_mm, Bound(27.0, 36.0, "mm"), action)

    @property
    def stiffness_ratio(self) -> float:
        """Young's modulus over the nominal one: the force ratio at which this slab is indented as deeply."""
        return self.youngs_modulus_kpa / NOMINAL_KPA

    def elastic_mismatch(self, youngs_modulus_kpa: float) -> float:
        """Return an inclusion's mismatch in this slab, (E - Et) / (E + 3/2 Et)."""
        return (youngs_modulus_kpa - self.youngs_modulus_kpa) / (youngs_modulus_kpa + 1.5 * self.youngs_modulus_kpa)

    def modulus_kpa(self, mismatch: float) -> float:
        """Return the Young's modulus of an inclusion of a mismatch below 1 in this slab."""
        return self.youngs_modulus_kpa * (1 + 1.5 * mismatch) / (1 - mismatch)

    def nominal_equivalent(self, inclusion: Inclusion) -> Inclusion:
        """Return the inclusion that has the same mismatch in the nominal slab: its modulus over `stiffness_ratio`."""
        return replace(inclusion, youngs_modulus_kpa=inclusion.youngs_modulus_kpa / self.stiffness_ratio)

    @property
    def stated(self) -> Slab:
        """The slab whose inclusions a table is asked for."""
        return self

    def changed(self, modulus_ratio: float) -> Slab:
        """Return the slab where its tissue is so much stiffer or softer (0.8-1.1), with the inclusions of this one."""
        if modulus_ratio == 1.0:
            return self
        return ChangedSlab(self.youngs_modulus_kpa * modulus_ratio, self.thickness_mm, self)


NOMINAL_KPA = 5.0
"""Young's modulus of normal tissue in Lee & Won, IEEE JBHI 17(2), 2013, section III."""
NOMINAL = Slab()


@dataclass(frozen=True)
class ChangedSlab(Slab):
    """Tissue softer or stiffer than that of the slab it is part of: the tables' quadratics go on a little there.

    Which inclusions it may hold, and of which one the field off the axis has the shape, is as in that slab.
    """

    part_of: Slab = NOMINAL

    def __post_init__(self) -> None:
        """Leave the bounds to the slab that it is part of."""

    @property
    def stated(self) -> Slab:
        """The slab that it is part of."""
        return self.part_of

    def nominal_equivalent(self, inclusion: Inclusion) -> Inclusion:
        """Return the inclusion that has the mismatch of the stated slab in the nominal one."""
        return self.part_of.nominal_equivalent(inclusion)
