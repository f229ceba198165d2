"""A scene: probe, tissue, inclusion and press, refused when the four contradict each other.

The origin is the centre of the probe's face on the undeformed tissue; z points out of the tissue. Units: mm, kPa, N.
Source of the training box: Lee & Won, IEEE JBHI 17(2), 2013, section III.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.scene_parts import Placement as Placement
from host_tools.scene_parts import Press as Press
from host_tools.scene_parts import Tissue as Tissue
from host_tools.scene_parts import TissueLayer as TissueLayer
from host_tools.scene_parts import Waveguide as Waveguide

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
