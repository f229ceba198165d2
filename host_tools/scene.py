"""A scene: the probe, the tissue, the inclusion and the press. Units are mm, kPa and N.

The paper leaves face, layer moduli, slab and press open; the defaults here are ours.
Layer 1, the hardest, faces the tissue. Source: Lee & Won, IEEE JBHI 17(2), 2013, sections II-III.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field

from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require

POSITIVE = "use the default or a measured value"
PAPER_BOX_LOW = (0.0, 4.0, 40.0)
PAPER_BOX_HIGH = (15.0, 12.0, 120.0)
"""The paper's training box of (size_mm, depth_mm, youngs_modulus_kpa)."""


def _positive(quantity: str, value: float, high: float, unit: str) -> None:
    require(quantity, value, Bound(0.0, high, unit, low_included=False), POSITIVE)


def _poisson(quantity: str, value: float) -> None:
    # Above 0.499 a displacement-only order-3 solution begins to lock (0.05 % at 0.499, 4 % at 0.49999).
    require(quantity, value, Bound(0.0, 0.499, ""), "use 0.49, the paper's value for every material")


@dataclass(frozen=True)
class Waveguide:
    """The round, soft, transparent probe: layers from the tissue side (hard) to the glass (soft)."""

    radius_mm: float = 11.0
    layer_thicknesses_mm: tuple[float, ...] = (2.0, 3.0, 5.0)
    layer_moduli_kpa: tuple[float, ...] = (60.0, 40.0, 20.0)
    poisson_ratio: float = 0.49

    def __post_init__(self) -> None:
        _positive("radius_mm", self.radius_mm, 100.0, "mm")
        if not self.layer_thicknesses_mm or len(self.layer_thicknesses_mm) != len(self.layer_moduli_kpa):
            raise InvalidQuantity(
                "layer_moduli_kpa",
                f"{len(self.layer_moduli_kpa)} values",
                f"as many as the {len(self.layer_thicknesses_mm)} layer thicknesses",
                "give one modulus for each layer",
            )
        for i, (thickness, modulus) in enumerate(zip(self.layer_thicknesses_mm, self.layer_moduli_kpa, strict=True)):
            _positive(f"layer_thicknesses_mm[{i}]", thickness, 100.0, "mm")
            _positive(f"layer_moduli_kpa[{i}]", modulus, 1e6, "kPa")
        _poisson("waveguide.poisson_ratio", self.poisson_ratio)

    @property
    def central_radius_mm(self) -> float:
        """Radius of the central window, 0.9 of the face: the rim beyond is singular."""
        return 0.9 * self.radius_mm


@dataclass(frozen=True)
class Tissue:
    """A homogeneous slab bonded to a rigid base."""

    youngs_modulus_kpa: float = 5.0
    thickness_mm: float = 30.0
    half_width_mm: float = 60.0
    poisson_ratio: float = 0.49

    def __post_init__(self) -> None:
        _positive("tissue_modulus_kpa", self.youngs_modulus_kpa, 1e6, "kPa")
        _positive("tissue.thickness_mm", self.thickness_mm, 1e3, "mm")
        _positive("tissue.half_width_mm", self.half_width_mm, 1e3, "mm")
        _poisson("tissue.poisson_ratio", self.poisson_ratio)


@dataclass(frozen=True)
class Press:
    """How hard the probe is pressed: either its back moves by `indentation_mm`, or it carries `force_n`."""

    indentation_mm: float | None = None
    force_n: float | None = None

    def __post_init__(self) -> None:
        if (self.indentation_mm is None) == (self.force_n is None):
            raise InvalidQuantity(
                "press",
                f"indentation_mm={self.indentation_mm}, force_n={self.force_n}",
                "exactly one of the two",
                "prescribe either the indentation or the force",
            )
        if self.indentation_mm is not None:
            _positive("indentation_mm", self.indentation_mm, 100.0, "mm")
        if self.force_n is not None:
            _positive("force_n", self.force_n, 1e4, "N")


@dataclass(frozen=True)
class Scene:
    """Everything the forward model needs. `inclusion` None means homogeneous tissue."""

    inclusion: Inclusion | None
    press: Press = field(default_factory=lambda: Press(indentation_mm=1.0))
    waveguide: Waveguide = field(default_factory=Waveguide)
    tissue: Tissue = field(default_factory=Tissue)

    def __post_init__(self) -> None:
        if self.waveguide.radius_mm >= self.tissue.half_width_mm:
            raise InvalidQuantity(
                "radius_mm",
                self.waveguide.radius_mm,
                f"below the tissue's half width of {self.tissue.half_width_mm:g} mm",
                "use a smaller probe or a wider slab",
            )
        if self.press.indentation_mm is not None and self.press.indentation_mm >= self.tissue.thickness_mm:
            raise InvalidQuantity(
                "indentation_mm",
                self.press.indentation_mm,
                f"below the slab's thickness of {self.tissue.thickness_mm:g} mm",
                "press less deep",
            )
        if self.inclusion is not None:
            self._require_inclusion_inside(self.inclusion)

    def _require_inclusion_inside(self, inclusion: Inclusion) -> None:
        bottom_mm = inclusion.depth_mm + inclusion.size_mm
        if bottom_mm >= self.tissue.thickness_mm:
            raise InvalidQuantity(
                "depth_mm + size_mm",
                f"{bottom_mm:g}",
                f"below the slab's thickness of {self.tissue.thickness_mm:g} mm",
                "move the inclusion up, make it smaller, or make the slab thicker",
            )
        if inclusion.size_mm / 2 >= self.tissue.half_width_mm:
            raise InvalidQuantity(
                "size_mm",
                inclusion.size_mm,
                f"below the slab's width of {2 * self.tissue.half_width_mm:g} mm",
                "make it smaller, or the slab wider",
            )

    @property
    def has_inclusion(self) -> bool:
        """False when the inclusion vanishes (no size) or is of the tissue's own modulus: nothing to solve for."""
        return (
            self.inclusion is not None
            and self.inclusion.size_mm > 0
            and self.inclusion.youngs_modulus_kpa != self.tissue.youngs_modulus_kpa
        )

    def surroundings(self) -> dict[str, object]:
        """Return what is not the inclusion, for the record of a data set or a table."""
        return {"waveguide": asdict(self.waveguide), "tissue": asdict(self.tissue), "press": asdict(self.press)}
