"""A scene to its half section: eight-node quadrilaterals of probe and tissue in the plane (r, z), the face at z = 0.

Probe and tissue share no node, not even where they touch: sliding is left to the contact search. The tissue is built
of blocks around the sphere (an O-grid), so that element edges, mid-side nodes included, lie on the sphere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import accumulate, pairwise

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from host_tools.scenes.scene import Scene
from host_tools.verification.cross_check.blocks import (
    Block,
    QuadSection,
    joined,
    line,
    patch,
    rectangle,
    stations,
    with_middles,
)

TISSUE, INCLUSION = "TISSUE", "INCLUSION"
CORE = 0.55
"""Half side of the square in the middle of the sphere, as a part of the radius."""


@dataclass(frozen=True)
class Sizes:
    """Element sizes in mm of the bulk, the face and both rims; `growth` is the change of size per mm from the rims.

    In finite strain keep the rims at or above 0.25 mm: a finer sharp rim stops the equilibrium iterations.
    """

    bulk_mm: float = 4.0
    face_mm: float = 1.5
    rim_mm: float = 0.5
    growth: float = 0.4
    per_quarter_circle: float = 5.0

    def refined(self, refinement: float) -> Sizes:
        """Return the sizes of a mesh `refinement` times finer in r and z; elements grow with its square."""
        return replace(
            self,
            bulk_mm=self.bulk_mm / refinement,
            face_mm=self.face_mm / refinement,
            rim_mm=self.rim_mm / refinement,
            per_quarter_circle=self.per_quarter_circle * refinement,
        )


def half_section(scene: Scene, sizes: Sizes) -> QuadSection:
    """Mesh the half section; materials TISSUE, INCLUSION, LAYER0 (on the tissue), LAYER1, ...

    Raises `InvalidQuantity` for a sphere wider than 1.8 probe radii: the O-grid has to fit under the face.
    """
    return joined(_probe_blocks(scene, sizes)) + joined(_tissue_blocks(scene, sizes))


def _face_radii(scene: Scene, sizes: Sizes) -> Array:
    a = scene.waveguide.radius_mm
    return stations(0, a, lambda r: np.minimum(sizes.face_mm, sizes.rim_mm + sizes.growth * (a - r)), least=3)


def _probe_blocks(scene: Scene, sizes: Sizes) -> list[Block]:
    r_mm = _face_radii(scene, sizes)
    heights = [0.0, *accumulate(scene.waveguide.layer_thicknesses_mm)]

    def size_at(z: Array) -> Array:
        return np.minimum(sizes.face_mm, sizes.rim_mm + sizes.growth * np.minimum(z, heights[-1] - z))

    return [
        Block(rectangle(r_mm, stations(low, high, size_at)), f"LAYER{i}")
        for i, (low, high) in enumerate(pairwise(heights))
    ]


def _sphere(scene: Scene) -> tuple[float, float]:
    """Return radius and height of the centre; without an inclusion, those of a sphere that only shapes the mesh."""
    T, a = scene.tissue.thickness_mm, scene.waveguide.radius_mm
    if scene.inclusion is None or scene.inclusion.size_mm == 0:
        radius = min(T / 6, a / 2)
        return radius, -T / 5 - radius
    radius = scene.inclusion.size_mm / 2
    if radius > 0.9 * a:
        raise InvalidQuantity(
            "size_mm", scene.inclusion.size_mm, f"at most {1.8 * a:g} mm", "use a wider probe or a smaller inclusion"
        )
    return radius, -scene.inclusion.depth_mm - radius


def _tissue_blocks(scene: Scene, sizes: Sizes) -> list[Block]:
    """Mesh the slab: a roof under the face, the box with the sphere, a floor, and the flank beyond the rim."""
    s, centre = _sphere(scene)
    a, R, T = scene.waveguide.radius_mm, scene.tissue.half_width_mm, scene.tissue.thickness_mm
    top, bottom = (centre + s) / 2, (centre - s - T) / 2

    def depth_size(z: Array) -> Array:
        return np.minimum(sizes.bulk_mm, sizes.rim_mm - sizes.growth * z)

    def flank_size(r: Array) -> Array:
        return np.minimum(sizes.bulk_mm, sizes.rim_mm + sizes.growth * (r - a))

    face, flank = _face_radii(scene, sizes), stations(a, R, flank_size)
    roof = stations(top, 0, depth_size)
    floor = stations(-T, bottom, depth_size)
    # The box's wall carries as many elements as the half circle it is joined to.
    wall = stations(bottom, top, depth_size, least=max(4, round(2 * sizes.per_quarter_circle)))
    tissue = [rectangle(face, roof), rectangle(face, floor)]
    tissue += [rectangle(flank, z) for z in (roof, wall, floor)]
    box, sphere = _sphere_grids(s, centre, face, wall, sizes)
    return [Block(grid, TISSUE) for grid in tissue + box] + [Block(grid, INCLUSION) for grid in sphere]


def _sphere_grids(s: float, centre: float, face: Array, wall: Array, sizes: Sizes) -> tuple[list[Array], list[Array]]:
    """Return the grids of the box around the sphere and those inside it; s is the sphere's radius.

    Three blocks between sphere and box, three between sphere and core, and the core, a half square.
    """
    a, bottom, top, c = face[-1], wall[0], wall[-1], CORE * s
    arc_mm = np.pi / 2 * s / sizes.per_quarter_circle

    def arc(first_deg: float, last_deg: float, n: int) -> Array:
        angle = np.radians(np.linspace(first_deg, last_deg, n))
        return np.stack([s * np.sin(angle), centre + s * np.cos(angle)], axis=-1)

    def uniform(n: int) -> Array:
        return np.linspace(0, 1, n)

    spoke = float(np.hypot(a - s * np.sqrt(0.5), top - centre - s * np.sqrt(0.5)))
    ring = stations(0, spoke, lambda x: np.minimum(sizes.bulk_mm, arc_mm + sizes.growth * x), least=2) / spoke
    shell = with_middles(np.linspace(0, 1, 1 + max(2, round((1 - CORE) * s / arc_mm))))
    n, m = len(face), len(wall)
    north, east, south = arc(0, 45, n), arc(45, 135, m), arc(180, 135, n)
    lid, base = np.stack([face, np.full(n, top)], axis=-1), np.stack([face, np.full(n, bottom)], axis=-1)
    side = np.stack([np.full(m, a), wall[::-1]], axis=-1)
    core_north = line((0, centre + c), (c, centre + c), uniform(n))
    core_south = line((0, centre - c), (c, centre - c), uniform(n))
    core_east = line((c, centre + c), (c, centre - c), uniform(m))

    def between(inner: Array, outer: Array, steps: Array) -> Array:
        spokes = [inner[k] + steps[:, None] * (outer[k] - inner[k]) for k in (0, -1)]
        return patch(inner, outer, *spokes)

    around = [between(north, lid, ring), between(east, side, ring), between(south, base, ring)]
    inside = [between(core_north, north, shell), between(core_east, east, shell), between(core_south, south, shell)]
    axis = line((0, centre + c), (0, centre - c), uniform(m))
    return around, [*inside, patch(axis, core_east, core_north, core_south)]
