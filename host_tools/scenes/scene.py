"""A scene: probe, tissue, inclusion and press, refused when the four contradict each other.

The origin is the centre of the probe's face on the undeformed tissue; z points out of the tissue. Units: mm, kPa, N.
Source of the training box: Lee & Won, IEEE JBHI 17(2), 2013, section III.

Layer 1 of the waveguide, the hardest, faces the tissue. The paper leaves face, layer moduli, slab and press open; the
defaults here are ours. Source: Lee & Won, IEEE JBHI 17(2), 2013, sections II-III.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field, replace
from itertools import accumulate
from typing import Literal

from device.measurement.paper_mode.trained_press import CENTRAL_RATIO
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require

POSITIVE = "use the default or a measured value"
FaceShape = Literal["round", "square"]
AskedStrain = Literal["small", "finite", "auto"]
WITHIN_S = 120.0
"""By which strain measure a scene is to be solved, `auto` by the tolerance, and in which time unless told otherwise."""


def _positive(quantity: str, value: float, high: float, unit: str) -> None:
    require(quantity, value, Bound(0.0, high, unit, low_included=False), POSITIVE)


def _poisson(quantity: str, value: float) -> None:
    require(quantity, value, Bound(0.0, 0.5, "", high_included=False), "use 0.49, the paper's value for every material")


@dataclass(frozen=True)
class Waveguide:
    """The soft, transparent probe: layers from the tissue side (hard) to the glass (soft).

    `radius_mm` is the radius of a round face and half the side of a square one. A domed face stands out by `dome_mm`
    in the middle and falls off as a paraboloid to the edge of the inscribed circle.
    """

    radius_mm: float = 11.0
    layer_thicknesses_mm: tuple[float, ...] = (2.0, 3.0, 5.0)
    layer_moduli_kpa: tuple[float, ...] = (60.0, 40.0, 20.0)
    poisson_ratio: float = 0.49
    face: FaceShape = "round"
    dome_mm: float = 0.0

    def __post_init__(self) -> None:
        _positive("radius_mm", self.radius_mm, 100.0, "mm")
        if self.face not in ("round", "square"):
            raise InvalidQuantity("waveguide.face", repr(self.face), "'round' or 'square'", "choose one of them")
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
        flat = Bound(0.0, self.layer_thicknesses_mm[0] / 2, "mm (half the first layer)")
        require("waveguide.dome_mm", self.dome_mm, flat, "make the dome flatter or the first layer thicker")

    @property
    def central_radius_mm(self) -> float:
        """Radius of the central window."""
        return CENTRAL_RATIO * self.radius_mm


@dataclass(frozen=True)
class TissueLayer:
    """One layer above the bulk of the tissue: skin, fat or gland."""

    name: str
    thickness_mm: float
    youngs_modulus_kpa: float
    poisson_ratio: float = 0.49

    def __post_init__(self) -> None:
        _positive(f"{self.name}.thickness_mm", self.thickness_mm, 1e3, "mm")
        _positive(f"{self.name}.youngs_modulus_kpa", self.youngs_modulus_kpa, 1e6, "kPa")
        _poisson(f"{self.name}.poisson_ratio", self.poisson_ratio)


@dataclass(frozen=True)
class Tissue:
    """A round slab bonded to a rigid base: optional layers from the surface down, then the bulk.

    `thickness_mm` is that of the whole slab, layers included. `edge_mm`, if given, is how far from the probe's axis
    the slab ends in a free plane edge, on the +x side.
    """

    youngs_modulus_kpa: float = 5.0
    thickness_mm: float = 30.0
    half_width_mm: float = 60.0
    poisson_ratio: float = 0.49
    layers: tuple[TissueLayer, ...] = ()
    edge_mm: float | None = None

    def __post_init__(self) -> None:
        _positive("tissue_modulus_kpa", self.youngs_modulus_kpa, 1e6, "kPa")
        _positive("tissue.thickness_mm", self.thickness_mm, 1e3, "mm")
        _positive("tissue.half_width_mm", self.half_width_mm, 1e3, "mm")
        _poisson("tissue.poisson_ratio", self.poisson_ratio)
        if self.edge_mm is not None:
            _positive("tissue.edge_mm", self.edge_mm, self.half_width_mm, "mm")
        above_bulk_mm = sum(layer.thickness_mm for layer in self.layers)
        if above_bulk_mm >= self.thickness_mm:
            raise InvalidQuantity(
                "sum of tissue.layers thickness_mm",
                f"{above_bulk_mm:g}",
                f"below the slab's thickness of {self.thickness_mm:g} mm",
                "make the layers thinner or the slab thicker",
            )

    @property
    def stack(self) -> tuple[TissueLayer, ...]:
        """Every layer from the surface down, the bulk last."""
        above = sum(layer.thickness_mm for layer in self.layers)
        bulk = TissueLayer("tissue", self.thickness_mm - above, self.youngs_modulus_kpa, self.poisson_ratio)
        return (*self.layers, bulk)

    @property
    def interface_depths_mm(self) -> tuple[float, ...]:
        """Depths of the planes between the layers, from the surface down; empty for a homogeneous slab."""
        return tuple(accumulate(layer.thickness_mm for layer in self.layers))


@dataclass(frozen=True)
class Placement:
    """Where the inclusion lies and what shape it has; the default is a sphere under the middle of the probe.

    `width_ratio_x` and `width_ratio_y` are its horizontal diameters over its vertical one, `size_mm`.
    """

    offset_x_mm: float = 0.0
    offset_y_mm: float = 0.0
    width_ratio_x: float = 1.0
    width_ratio_y: float = 1.0
    poisson_ratio: float = 0.49

    def __post_init__(self) -> None:
        for name in ("offset_x_mm", "offset_y_mm"):
            require(
                f"placement.{name}", getattr(self, name), Bound(-1e3, 1e3, "mm"), "give the inclusion's place in mm"
            )
        for name in ("width_ratio_x", "width_ratio_y"):
            require(f"placement.{name}", getattr(self, name), Bound(0.2, 5.0, ""), "give 1 for a sphere")
        _poisson("placement.poisson_ratio", self.poisson_ratio)

    @property
    def is_round(self) -> bool:
        """Whether every horizontal section is a circle."""
        return self.width_ratio_x == self.width_ratio_y

    @property
    def is_sphere(self) -> bool:
        """Whether all three diameters agree."""
        return self.is_round and self.width_ratio_x == 1.0

    @property
    def offset_mm(self) -> float:
        """Distance of its centre from the probe's axis."""
        return math.hypot(self.offset_x_mm, self.offset_y_mm)


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

    def scaled(self, ratio: float) -> Press:
        """Return so many times the press, by what it is prescribed by."""
        if self.indentation_mm is not None:
            return Press(indentation_mm=ratio * self.indentation_mm)
        assert self.force_n is not None  # guaranteed above
        return Press(force_n=ratio * self.force_n)


PAPER_BOX_LOW = (0.0, 4.0, 40.0)
PAPER_BOX_HIGH = (15.0, 12.0, 120.0)
"""The paper's training box of (size_mm, depth_mm, youngs_modulus_kpa)."""

NEAREST_MM = 1e-3
"""An inclusion nearer to the base than this leaves a sliver that cannot be meshed."""

SKIN = "skin"
"""Name of the tissue layer that no inclusion may reach into."""


@dataclass(frozen=True)
class Scene:
    """Everything the forward model needs. `inclusion` None means homogeneous tissue."""

    inclusion: Inclusion | None = None
    press: Press = field(default_factory=lambda: Press(indentation_mm=1.0))
    waveguide: Waveguide = field(default_factory=Waveguide)
    tissue: Tissue = field(default_factory=Tissue)
    placement: Placement = field(default_factory=Placement)

    def __post_init__(self) -> None:
        _require_probe_on_slab(self)
        if self.inclusion is not None:
            _require_inclusion_in_slab(self, self.inclusion)

    @property
    def has_inclusion(self) -> bool:
        """False when the inclusion vanishes (no size) or is of the tissue's own material: nothing to solve for."""
        if self.inclusion is None or self.inclusion.size_mm == 0:
            return False
        own = (self.inclusion.youngs_modulus_kpa, self.placement.poisson_ratio)
        return any(own != (layer.youngs_modulus_kpa, layer.poisson_ratio) for layer in self.layers_around_inclusion)

    @property
    def layers_around_inclusion(self) -> tuple[TissueLayer, ...]:
        """The tissue layers that the inclusion lies in."""
        if self.inclusion is None:
            return ()
        top, bottom = self.inclusion.depth_mm, self.inclusion.depth_mm + self.inclusion.size_mm
        floors = (*self.tissue.interface_depths_mm, self.tissue.thickness_mm)
        ceilings = (0.0, *floors[:-1])
        pairs = zip(self.tissue.stack, ceilings, floors, strict=True)
        return tuple(layer for layer, ceiling, floor in pairs if top < floor and bottom > ceiling)

    def with_press(self, press: Press) -> Scene:
        """Return the same scene under another press."""
        return replace(self, press=press)

    def surroundings(self) -> dict[str, object]:
        """Return what is not the inclusion, for the record of a data set or a table."""
        return {"waveguide": asdict(self.waveguide), "tissue": asdict(self.tissue), "press": asdict(self.press)}


def _require_below(quantity: str, value: float, bound: float, of_what: str, action: str) -> None:
    """Refuse a length that reaches a bound set by another length; name both."""
    if value >= bound:
        raise InvalidQuantity(quantity, f"{value:g} mm", f"below {of_what} of {bound:g} mm", action)


def _require_probe_on_slab(scene: Scene) -> None:
    probe, tissue, press = scene.waveguide, scene.tissue, scene.press
    reach_mm = probe.radius_mm * (2**0.5 if probe.face == "square" else 1.0)
    width = "the tissue's half width"
    _require_below("radius_mm", reach_mm, tissue.half_width_mm, width, "use a smaller probe or a wider slab")
    if tissue.edge_mm is not None:
        edge = "the distance to the slab's edge"
        _require_below("radius_mm", probe.radius_mm, tissue.edge_mm, edge, "move the probe off the edge")
    if press.indentation_mm is not None:
        thickness = "the slab's thickness"
        _require_below("indentation_mm", press.indentation_mm, tissue.thickness_mm, thickness, "press less deep")


def _require_inclusion_in_slab(scene: Scene, inclusion: Inclusion) -> None:
    tissue, place = scene.tissue, scene.placement
    bottom_mm = inclusion.depth_mm + inclusion.size_mm
    action = "move the inclusion up, make it smaller, or make the slab thicker"
    _require_below("depth_mm + size_mm", bottom_mm, tissue.thickness_mm - NEAREST_MM, "the slab's thickness", action)
    if tissue.layers and tissue.layers[0].name == SKIN and inclusion.depth_mm <= tissue.layers[0].thickness_mm:
        raise InvalidQuantity(
            "depth_mm",
            f"{inclusion.depth_mm:g} mm",
            f"above the skin's thickness of {tissue.layers[0].thickness_mm:g} mm",
            "move the inclusion down, or make the skin thinner",
        )
    half_mm = inclusion.size_mm / 2 * max(place.width_ratio_x, place.width_ratio_y)
    action = "make it smaller, move it inwards, or make the slab wider"
    _require_below("size_mm / 2 + offset", half_mm + place.offset_mm, tissue.half_width_mm, "the half width", action)
    if tissue.edge_mm is not None:
        right_mm = place.offset_x_mm + inclusion.size_mm / 2 * place.width_ratio_x
        edge = "the distance to the slab's edge"
        _require_below("size_mm / 2 + offset_x_mm", right_mm, tissue.edge_mm, edge, "move it away from the edge")
