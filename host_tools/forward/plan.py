"""A scene to the model that it requires, each choice with its reason.

Symmetry, contact and formulation follow from the scene alone. Strain is told, or chosen by what small strain departs by
(`ladder.py`, where a tolerance takes the level, too). Data sets stay at the level that stands here.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from math import atan2
from typing import Any, Literal, NamedTuple

from device.measurement.quantities import InvalidQuantity
from host_tools.forward.materials import LOCKING_POISSON_RATIO, baseline, with_inclusion
from host_tools.forward.meshes.mesh import PER_CONTACT, Resolution, touching_radius_mm
from host_tools.forward.meshes.morph import reaches
from host_tools.forward.meshes.solid_mesh import solid_symmetry
from host_tools.forward.sampling import FaceSector
from host_tools.scenes.scene import Scene

StrainModel = Literal["small", "finite"]
Contact = Literal["closed_sliding", "unilateral", "true_sliding"]


class Level(NamedTuple):
    """Element order and the name of the element sizes it goes with."""

    grading: str
    order: int


DEFAULT_TOLERANCE = 0.005
"""What is aimed at where no tolerance is asked for, by the command line and in Python."""
STANDARD = Level("standard", 3)
"""The level of every data set: one level for all scenes, or features would jump where the plan changes its mind."""
GRADED = "graded"
"""The element sizes of one scene that climbs from order to order: layers around the rims, large elements elsewhere."""
SLIDING = ("sliding_coarse", "sliding", "sliding_fine")
"""The element sizes of a climb in finite strain, by the rim of the contact; the bonded rim, which does not slip, is
fine in all of them."""
BLUNT = Level("blunt", 3)
"""The level of data sets in finite strain: elements at the sharp rims no smaller than the slip, or they fold."""

FINITE_IS_LIMITED = f"finite strain is axisymmetric, flat-faced and of Poisson ratios to {LOCKING_POISSON_RATIO} only"


@dataclass(frozen=True)
class ModelPlan:
    """Which model a scene is solved by; `reasons` says why, one sentence a choice."""

    symmetry: FaceSector
    strain: StrainModel
    contact: Contact
    formulation: Literal["displacement", "mixed"]
    mesh: Literal["morphed", "remeshed"]
    grading: str
    order: int
    reasons: dict[str, str] = field(default_factory=dict)

    @property
    def level(self) -> str:
        """Strain measure, mesh and order in words."""
        return f"{self.strain} strain, {self.grading} {self.order}"

    def as_record(self) -> dict[str, Any]:
        """Return the plan as the JSON object of `host_tools simulate --json`."""
        return asdict(self)


def model_plan(scene: Scene, *, strain: StrainModel = "small", because: str = "asked for") -> ModelPlan:
    """Return the plan at the level that all data sets share; `because` is why the strain measure was chosen.

    Raise `InvalidQuantity` when no model of ours serves the scene (finite strain off the axis or under a dome).
    """
    reasons: dict[str, str] = {}
    symmetry = _symmetry(scene, reasons)
    _require_strain(scene, symmetry, strain)
    reasons["strain"] = because
    contact = _contact(scene, strain, reasons)
    formulation = _formulation(scene, strain, reasons)
    mesh = _mesh(scene, symmetry, reasons)
    level = BLUNT if strain == "finite" else STANDARD
    reasons["level"] = "the level that all data sets share, so that features are smooth"
    return ModelPlan(symmetry, strain, contact, formulation, mesh, level.grading, level.order, reasons)


def _symmetry(scene: Scene, reasons: dict[str, str]) -> FaceSector:
    place = scene.placement if scene.has_inclusion else None
    broken = []
    if scene.waveguide.face == "square":
        broken.append("the face is square")
    if scene.tissue.edge_mm is not None:
        broken.append("the slab ends in a plane edge")
    if place is not None and place.offset_mm > 0:
        broken.append(f"the inclusion lies {place.offset_mm:g} mm off the axis")
    if place is not None and not place.is_round:
        broken.append("the inclusion is an ellipsoid")
    if not broken:
        reasons["symmetry"] = "round probe, and nothing off its axis: every section is the same"
        return "axisymmetric"
    sector = solid_symmetry(aligned(scene)[0])
    planes = {"quarter": "x = 0 and y = 0 are", "half": "y = 0 is", "full": "no plane is"}[sector]
    reasons["symmetry"] = f"{' and '.join(broken)}; {planes} a plane of symmetry"
    return sector


def aligned(scene: Scene) -> tuple[Scene, float]:
    """Return the scene turned so that the inclusion lies on +x, and the angle (rad) it was turned by.

    Only what is round in the face, the slab and the inclusion can be turned; any other scene comes back as it is.
    """
    place = scene.placement
    round_about = scene.waveguide.face == "round" and scene.tissue.edge_mm is None and place.is_round
    if not round_about or place.offset_mm == 0 or (place.offset_y_mm == 0 and place.offset_x_mm > 0):
        return scene, 0.0
    turned = replace(place, offset_x_mm=place.offset_mm, offset_y_mm=0.0)
    return replace(scene, placement=turned), atan2(place.offset_y_mm, place.offset_x_mm)


def has_finite_strain(scene: Scene) -> bool:
    """Return whether finite strain serves a scene."""
    return _is_flat_section(scene, _symmetry(scene, {})) and not _locks(scene)


def _is_flat_section(scene: Scene, symmetry: FaceSector) -> bool:
    return symmetry == "axisymmetric" and scene.waveguide.dome_mm == 0


def _require_strain(scene: Scene, symmetry: FaceSector, strain: StrainModel) -> None:
    if strain == "finite" and not _is_flat_section(scene, symmetry):
        raise InvalidQuantity(
            "strain", "finite", "small for a scene that is not axisymmetric or has a domed face", "ask for small strain"
        )


def _contact(scene: Scene, strain: StrainModel, reasons: dict[str, str]) -> Contact:
    if strain == "finite":
        reasons["contact"] = "in finite strain the tissue slips under the face, and its sliding counts"
        return "true_sliding"
    if scene.waveguide.dome_mm > 0:
        reasons["contact"] = f"the dome of {scene.waveguide.dome_mm:g} mm may lift off the tissue at its rim"
        return "unilateral"
    reasons["contact"] = "a flat face in compression stays closed (the pressure is checked)"
    return "closed_sliding"


def _formulation(scene: Scene, strain: StrainModel, reasons: dict[str, str]) -> Literal["displacement", "mixed"]:
    locks = _locks(scene)
    if locks and strain == "finite":
        raise InvalidQuantity(
            "poisson_ratio",
            _largest_poisson_ratio(scene),
            f"at most {LOCKING_POISSON_RATIO} in finite strain",
            "ask for small strain",
        )
    if locks:
        reasons["formulation"] = f"a Poisson ratio above {LOCKING_POISSON_RATIO} locks displacements alone"
        return "mixed"
    reasons["formulation"] = f"no Poisson ratio above {LOCKING_POISSON_RATIO}: displacements alone do not lock"
    return "displacement"


def _locks(scene: Scene) -> bool:
    return with_inclusion(scene).locks or baseline(scene).locks


def _largest_poisson_ratio(scene: Scene) -> float:
    return max(*with_inclusion(scene).poisson_ratio.values(), *baseline(scene).poisson_ratio.values())


def _mesh(scene: Scene, symmetry: FaceSector, reasons: dict[str, str]) -> Literal["morphed", "remeshed"]:
    touches_wide = touching_radius_mm(scene) > PER_CONTACT * Resolution.face_mm
    if symmetry == "axisymmetric" and scene.has_inclusion and reaches(scene) and touches_wide:
        reasons["mesh"] = "inside the training box: one mesh of fixed topology, smooth in size and depth"
        return "morphed"
    reasons["mesh"] = "outside what the fixed topology reaches: meshed anew (features jump by up to 1e-3)"
    return "remeshed"
