"""A scene to a graded mesh of the whole body or its half or quarter; the face at z = 0, tissue below.

Faces are named by what lies on either side of them: the inclusion may cross the tissue's layers, and gluing then cuts
faces anew. A dome is not drawn; it is a gap of the contact. Towards both singular rims of the probe the elements are
layered (prisms) instead of small all round, which halves the unknowns for the same error of the force.
Source of the layers: Schwab, p- and hp-Finite Element Methods (1998), geometric meshes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from typing import Any, Literal, get_args

import numpy as np
from netgen.occ import Box, Cylinder, Glue, OCCGeometry, Pnt, Sphere, Z, gp_GTrsf
from ngsolve import HEX, PRISM, PYRAMID, TET, VOL, Det, IntegrationRule, Mesh, specialcf

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.meshes.mesh import spread
from host_tools.scenes.scene import Scene

SolidSymmetry = Literal["quarter", "half", "full"]
PARTS = get_args(SolidSymmetry)
"""From the smallest part of the body to all of it."""

Shape = Any
"""A solid, face or edge of the geometry kernel."""

ON_PLANE_MM = 1e-6
"""Closer than this to a plane is on it; the kernel's own tolerance is 1e-7 mm."""

BETWEEN = {("layer", "layer"): "bond", ("layer", "tissue"): "face", ("inclusion", "tissue"): "sphere"}
"""Names of the inner faces by the bodies on either side; any other pair is an `interface` of tissue layers."""

FOOTPRINT_RATIO = 1 / 5
"""Largest element of the surface above the inclusion over the depth of its centre, which sets the field's width."""

ATTEMPTS = 3
"""Meshes tried, each finer at the inclusion, before a gap too thin for curved elements is refused."""


@dataclass(frozen=True)
class SolidResolution:
    """Element sizes in mm: bulk, face, along both rims, and elements per mean diameter of the inclusion.

    `rim_layers` layers of elements are laid around each rim, the first ending at `rim_ratio` of the elements there and
    each further one at that ratio of the one before; no layers leave tetrahedra only. With the defaults a quarter at
    order 3 holds 0.3 % on O1 and O2 of the inclusion field and 0.4 % on the force (inclusions of 2-20 mm, 0.5-15 mm
    deep; against the axisymmetric solution).
    """

    bulk_mm: float = 12.0
    face_mm: float = 2.0
    contact_rim_mm: float = 1.25
    back_rim_mm: float = 2.0
    per_inclusion: float = 8.0
    grading: float = 0.5
    rim_layers: int = 1
    rim_ratio: float = 0.1


COARSE = SolidResolution(bulk_mm=15.0, face_mm=3.0, contact_rim_mm=2.0, back_rim_mm=3.0, per_inclusion=6.0, grading=0.6)
LAYERED = SolidResolution(
    bulk_mm=20.0,
    face_mm=4.0,
    contact_rim_mm=4.0,
    back_rim_mm=5.0,
    per_inclusion=6.0,
    grading=0.6,
)
"""Large elements, for orders from 3: 1300-1700 of a half body, whose errors fall from order to order.

Elements that grow faster around the inclusion (grading 0.8, a quarter fewer) leave ten times the error at order 4."""


def solid_symmetry(scene: Scene) -> SolidSymmetry:
    """Return the smallest part of the body that stands for all of it."""
    offset_x_mm, offset_y_mm = 0.0, 0.0
    if scene.has_inclusion:
        offset_x_mm, offset_y_mm = scene.placement.offset_x_mm, scene.placement.offset_y_mm
    if offset_y_mm != 0:
        return "full"
    return "half" if offset_x_mm != 0 or scene.tissue.edge_mm is not None else "quarter"


def solid_mesh(scene: Scene, *, symmetry: SolidSymmetry, order: int, resolution: SolidResolution | None = None) -> Mesh:
    """Return the curved mesh of a part of the body that `solid_symmetry` allows, for elements of an order.

    Materials are layer0.. (from the face up), tissue0.. (from the surface down) and inclusion0.. (by the tissue layer
    around). Faces are face, back, base, side, skin, wall, bond, sphere, interface, plane_x (x = 0), plane_y (y = 0).
    The same scene and order give the same mesh. Raises `InvalidQuantity` for a symmetry the scene has not, and for an
    inclusion too close to another surface for elements that follow its curvature.
    """
    _require_symmetry(scene, symmetry)
    resolution = resolution or SolidResolution()
    body = _body(scene, symmetry)
    _name_faces(body, scene, symmetry)
    for _ in range(ATTEMPTS):
        mesh = _graded_mesh(body, scene, resolution)
        mesh.Curve(order + 1)
        inverted = _inverted_elements(mesh)
        if not inverted:
            return mesh
        resolution = replace(resolution, per_inclusion=1.5 * resolution.per_inclusion)
    raise InvalidQuantity(
        "elements turned inside out",
        f"{inverted} of {mesh.ne}",
        "none",
        "give the inclusion a wider gap to the slab's surfaces and layers, or choose a finer resolution",
    )


def _require_symmetry(scene: Scene, symmetry: SolidSymmetry) -> None:
    smallest = solid_symmetry(scene)
    if PARTS.index(symmetry) < PARTS.index(smallest):
        raise InvalidQuantity(
            "symmetry",
            repr(symmetry),
            f"{smallest!r} or larger for this scene",
            "mesh a larger part, or turn the scene so that the inclusion's offset lies along x",
        )


def _parts(scene: Scene) -> Iterator[Shape]:
    """Yield every material of the whole body, the slab's layers without the inclusion's part in them."""
    yield from _waveguide_layers(scene)
    inclusion = scene.inclusion if scene.has_inclusion else None
    floors_mm = (*scene.tissue.interface_depths_mm, scene.tissue.thickness_mm)
    for i, (top_mm, bottom_mm) in enumerate(pairwise((0.0, *floors_mm))):
        slab = Cylinder(Pnt(0, 0, -bottom_mm), Z, scene.tissue.half_width_mm, bottom_mm - top_mm)
        if inclusion is None or inclusion.depth_mm >= bottom_mm or inclusion.depth_mm + inclusion.size_mm <= top_mm:
            yield slab.mat(f"tissue{i}")
        else:
            ellipsoid = _ellipsoid(scene, inclusion)
            yield (slab - ellipsoid).mat(f"tissue{i}")
            yield (slab * ellipsoid).mat(f"inclusion{i}")


def _waveguide_layers(scene: Scene) -> Iterator[Shape]:
    a = scene.waveguide.radius_mm
    heights_mm = accumulate(scene.waveguide.layer_thicknesses_mm, initial=0.0)
    for i, (low_mm, high_mm) in enumerate(pairwise(heights_mm)):
        if scene.waveguide.face == "square":
            layer = Box(Pnt(-a, -a, low_mm), Pnt(a, a, high_mm))
        else:
            layer = Cylinder(Pnt(0, 0, low_mm), Z, a, high_mm - low_mm)
        yield layer.mat(f"layer{i}")


def _ellipsoid(scene: Scene, inclusion: Inclusion) -> Shape:
    """Return the inclusion; stretched from a sphere, for the kernel's own ellipsoid is cut wrongly by planes."""
    place, a = scene.placement, inclusion.size_mm / 2
    centre_mm = [place.offset_x_mm, place.offset_y_mm, -inclusion.depth_mm - a]
    if place.is_sphere:
        return Sphere(Pnt(*centre_mm), a)
    stretch = [a * place.width_ratio_x, 0, 0, 0, a * place.width_ratio_y, 0, 0, 0, a]
    return gp_GTrsf(stretch, centre_mm)(Sphere(Pnt(0, 0, 0), 1))


def _body(scene: Scene, symmetry: SolidSymmetry) -> Shape:
    """Return what the symmetry and the slab's edge leave of the parts, glued together.

    A stretched inclusion is glued before it is cut: cut first, it shares no surface with the tissue around and lies
    loose in its hole. A sphere that touches a tissue layer is cut first: glued first, it is lost.
    """
    parts, kept = list(_parts(scene)), _kept(scene, symmetry)
    if kept is None:
        return Glue(parts)
    if scene.has_inclusion and not scene.placement.is_sphere:
        return Glue(parts) * kept
    return Glue([part * kept for part in parts])


def _kept(scene: Scene, symmetry: SolidSymmetry) -> Shape | None:
    """Return the box that symmetry and the slab's edge leave; None for all of the body."""
    far_mm = 2 * scene.tissue.half_width_mm
    high_mm, low_mm = 2 * sum(scene.waveguide.layer_thicknesses_mm), -2 * scene.tissue.thickness_mm
    corner = Pnt(0 if symmetry == "quarter" else -far_mm, -far_mm if symmetry == "full" else 0, low_mm)
    whole = symmetry == "full" and scene.tissue.edge_mm is None
    return None if whole else Box(corner, Pnt(scene.tissue.edge_mm or far_mm, far_mm, high_mm))


def _name_faces(body: Shape, scene: Scene, symmetry: SolidSymmetry) -> None:
    sides: dict[Shape, list[str]] = {}
    for solid in body.solids:
        for face in solid.faces:
            sides.setdefault(face, []).append(solid.name.rstrip("0123456789"))
    for face, kinds in sides.items():
        if len(kinds) == 2:
            face.name = BETWEEN.get((min(kinds), max(kinds)), "interface")
        else:
            face.name = _outer_name(face.center, kinds[0], scene, symmetry)


def _outer_name(centre: Shape, kind: str, scene: Scene, symmetry: SolidSymmetry) -> str:
    """Name a face of the surface by its centre of mass; a curved one bulges off the planes of symmetry."""
    back_mm, base_mm = sum(scene.waveguide.layer_thicknesses_mm), -scene.tissue.thickness_mm
    for name, distance_mm in (("back", centre.z - back_mm), ("base", centre.z - base_mm), ("skin", centre.z)):
        if abs(distance_mm) < ON_PLANE_MM:
            return name
    if symmetry == "quarter" and abs(centre.x) < ON_PLANE_MM:
        return "plane_x"
    if symmetry != "full" and abs(centre.y) < ON_PLANE_MM:
        return "plane_y"
    return "wall" if kind == "layer" else "side"


def _graded_mesh(body: Shape, scene: Scene, resolution: SolidResolution) -> Mesh:
    """Return the mesh, still straight, with the rims in layers."""
    body.faces["face"].maxh = resolution.face_mm
    if spread(scene) > 1:
        body.solids["layer.*"].maxh = resolution.bulk_mm
    _size_rims(body, scene, resolution)
    inclusion, place = scene.inclusion if scene.has_inclusion else None, scene.placement
    if inclusion is not None:
        mean_mm = inclusion.size_mm * (place.width_ratio_x * place.width_ratio_y) ** (1 / 3)
        body.solids["inclusion.*"].maxh = mean_mm / resolution.per_inclusion
    geometry = OCCGeometry(body)
    if inclusion is not None:
        footprint_mm = FOOTPRINT_RATIO * (inclusion.depth_mm + inclusion.size_mm / 2)
        geometry.RestrictH((place.offset_x_mm, place.offset_y_mm, 0.0), footprint_mm)
    sizes = {"maxh": resolution.bulk_mm * spread(scene), "grading": resolution.grading}
    mesh = Mesh(geometry.GenerateMesh(**sizes, parallel_meshing=False))  # threads: another mesh at every call
    if resolution.rim_layers:
        mesh.RefineHP(resolution.rim_layers, resolution.rim_ratio)
    return mesh


def _size_rims(body: Shape, scene: Scene, resolution: SolidResolution) -> None:
    """Set the element size along contact rim and back rim, and mark them for layers."""
    back_mm = sum(scene.waveguide.layer_thicknesses_mm)
    for edge in body.faces["wall"].edges:
        for height_mm, size_mm in ((0.0, resolution.contact_rim_mm), (back_mm, resolution.back_rim_mm)):
            if abs(edge.center.z - height_mm) < ON_PLANE_MM:
                edge.maxh = size_mm
                edge.hpref = 1


def _inverted_elements(mesh: Mesh) -> int:
    """Count elements that curving turned inside out: they would be solved without a complaint."""
    rules = {shape: IntegrationRule(shape, 4) for shape in (TET, PRISM, HEX, PYRAMID)}
    points = np.array([len(rules[element.type].points) for element in mesh.Elements(VOL)])
    volume_ratio = Det(specialcf.JacobianMatrix(3))(mesh.MapToAllElements(rules, VOL)).ravel()
    starts = np.concatenate([[0], np.cumsum(points)[:-1]])
    return int(np.sum(np.minimum.reduceat(volume_ratio, starts) * np.maximum.reduceat(volume_ratio, starts) <= 0))
