"""A centred scene to a graded axisymmetric mesh; the half plane r > 0 with the sensing face at z = 0, tissue below.

Both rims of the face carry a singularity: the contact rim and the bonded back rim. Left ungraded, the back rim alone
costs 0.3 % of the surface displacement at order 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import asin, inf, pi
from typing import Any

from ngsolve import Mesh

from host_tools.forward.meshes.sketch import OUTSIDE, Arc, Sketch, draw_waveguide
from host_tools.scenes.scene import Scene

LARGE_SLAB_MM = 120.0
"""A slab thicker or wider than this has its far elements grow with it: their number stays."""
PER_CONTACT = 4.0
"""Elements of the face over the radius of a dome's contact."""


@dataclass(frozen=True)
class Resolution:
    """Element sizes in mm: bulk, face, both rims, and elements per diameter of the inclusion.

    `rim_layers` rings of elements are laid around each rim, each `rim_ratio` of the one before: towards a singular
    point errors then fall exponentially with the order, and not like a power of it.
    Source: Schwab, p- and hp-Finite Element Methods (1998), geometric meshes.

    The defaults hold 0.1 % on O1, O2 and force over the paper's box (`tests/host_tools/forward/test_accuracy.py`).
    """

    bulk_mm: float = 3.0
    face_mm: float = 1.0
    contact_rim_mm: float = 0.01
    back_rim_mm: float = 0.01
    per_inclusion: float = 16.0
    grading: float = 0.4
    rim_layers: int = 0
    rim_ratio: float = 0.25


def axisymmetric_mesh(scene: Scene, *, order: int, resolution: Resolution | None = None) -> Any:
    """Return the curved mesh; materials as in `materials.py`, boundaries face, back, base, side, skin, axis, sphere."""
    size = resolution or Resolution()
    sketch = Sketch(size.bulk_mm)
    arc = _arc(scene)
    above_arc_mm = size.face_mm if arc is None else min(size.face_mm, max(-arc.at(pi / 2)[1], 0.02))
    centre = sketch.point(0, 0, min(above_arc_mm, touching_radius_mm(scene) / PER_CONTACT))
    layered = size.rim_layers > 0
    rim = sketch.point(scene.waveguide.radius_mm, 0, size.contact_rim_mm, layered=layered)
    sketch.line(centre, rim, left="layer0", right="tissue0", boundary="face", size_mm=size.face_mm)
    _TissueSection(sketch, scene, size, arc).draw(centre, rim)
    draw_waveguide(sketch, scene.waveguide, centre, rim, size.back_rim_mm, layered=layered)
    mesh = Mesh(sketch.mesh(size.grading, size.bulk_mm * spread(scene)))
    if layered:
        mesh.RefineHP(size.rim_layers, size.rim_ratio)  # before it is curved
    mesh.Curve(order + 1)
    return mesh


def spread(scene: Scene) -> float:
    """Return how many times larger the elements far from the probe may be: 1 up to a slab of `LARGE_SLAB_MM`.

    A wide slab counts up to four times its thickness, for elements as long as it is thin would fold.
    """
    thickness_mm = scene.tissue.thickness_mm
    return max(1.0, max(thickness_mm, min(scene.tissue.half_width_mm, 4 * thickness_mm)) / LARGE_SLAB_MM)


def touching_radius_mm(scene: Scene) -> float:
    """Return the radius over which a dome touches, about, by Hertz; infinite for a flat face."""
    probe, tissue, press = scene.waveguide, scene.tissue.stack[0], scene.press
    if probe.dome_mm == 0:
        return inf
    curvature_radius_mm = probe.radius_mm**2 / (2 * probe.dome_mm)
    if press.indentation_mm is not None:
        return float((curvature_radius_mm * press.indentation_mm) ** 0.5)
    assert press.force_n is not None  # Press guarantees one of the two
    plane_modulus_kpa = tissue.youngs_modulus_kpa / (1 - tissue.poisson_ratio**2)
    return float((0.75e3 * press.force_n * curvature_radius_mm / plane_modulus_kpa) ** (1 / 3))


def _arc(scene: Scene) -> Arc | None:
    if not scene.has_inclusion or scene.inclusion is None:
        return None
    radius_mm = scene.inclusion.size_mm / 2
    return Arc(-scene.inclusion.depth_mm - radius_mm, radius_mm, scene.placement.width_ratio_x)


class _TissueSection:
    """Draws the slab with its layers and, if there is one, the half spheroid that may cross them."""

    def __init__(self, sketch: Sketch, scene: Scene, size: Resolution, arc: Arc | None) -> None:
        self.sketch, self.size, self.arc = sketch, size, arc
        self.half_width_mm, self.far_mm = scene.tissue.half_width_mm, size.bulk_mm * spread(scene)
        self.interfaces_mm = [-depth for depth in scene.tissue.interface_depths_mm]
        self.base_mm = -scene.tissue.thickness_mm
        self.inclusion_mm = size.face_mm
        if arc is not None:
            narrow = 2 * arc.radius_mm * min(1.0, arc.width_ratio)
            self.inclusion_mm = min(size.face_mm, narrow / size.per_inclusion)

    def draw(self, centre: int, rim: int) -> None:
        """Draw everything below the face, whose end points are given."""
        top = self.sketch.point(self.half_width_mm, 0, self.far_mm)
        self.sketch.line(top, rim, left="tissue0", right=OUTSIDE, boundary="skin", size_mm=self.far_mm)
        on_arc = self._draw_arc()
        on_axis = {0.0: centre} | {z: point for (r, z), point in on_arc.items() if r == 0}
        on_side = {0.0: top}
        for z in [*self.interfaces_mm, self.base_mm]:
            on_axis.setdefault(z, self.sketch.point(0, z, self.far_mm))
            on_side[z] = self.sketch.point(self.half_width_mm, z, self.far_mm)
            crossing = next((point for (r, z_arc), point in on_arc.items() if r > 0 and z_arc == z), None)
            self._draw_plane(z, on_axis[z], crossing, on_side[z])
        self._draw_axis(on_axis)
        for upper, lower in pairwise(sorted(on_side, reverse=True)):
            material = self._material("tissue", (upper + lower) / 2)
            self.sketch.line(
                on_side[lower], on_side[upper], left=material, right=OUTSIDE, boundary="side", size_mm=self.far_mm
            )

    def _layer(self, z_mm: float) -> int:
        return sum(z_mm < interface for interface in self.interfaces_mm)

    def _material(self, kind: str, z_mm: float) -> str:
        return f"{kind}{self._layer(z_mm)}"

    def _draw_arc(self) -> dict[tuple[float, float], int]:
        """Draw the inclusion's outline; return its points by (r, z)."""
        if self.arc is None:
            return {}
        arc, a, c = self.arc, self.arc.radius_mm, self.arc.centre_z_mm
        crossings = {asin((z - c) / a): z for z in self.interfaces_mm if abs(z - c) < a}
        angles = sorted({-pi / 2, pi / 2, *(crossings or (0.0,))})
        places = [(arc.at(angle)[0], crossings.get(angle, arc.at(angle)[1])) for angle in angles]
        points = [self.sketch.point(*place, self.inclusion_mm) for place in places]
        middles = [arc.at((start + stop) / 2)[1] for start, stop in pairwise(angles)]
        self.sketch.arc(
            arc,
            angles,
            points,
            left=[self._material("inclusion", z) for z in middles],
            right=[self._material("tissue", z) for z in middles],
            size_mm=self.inclusion_mm,
        )
        return dict(zip(places, points, strict=True))

    def _draw_plane(self, z: float, axis: int, crossing: int | None, side: int) -> None:
        """Draw an interface between layers, or the base, from the axis or the inclusion outwards."""
        k = self._layer(z)  # the layer above: z itself is not below its own interface
        below, name = (OUTSIDE, "base") if z == self.base_mm else (f"tissue{k + 1}", "interface")
        if crossing is None:
            self.sketch.line(axis, side, left=f"tissue{k}", right=below, boundary=name, size_mm=self.far_mm)
            return
        self.sketch.line(axis, crossing, left=f"inclusion{k}", right=f"inclusion{k + 1}", boundary=name)
        self.sketch.line(crossing, side, left=f"tissue{k}", right=below, boundary=name, size_mm=self.far_mm)

    def _draw_axis(self, on_axis: dict[float, int]) -> None:
        for upper, lower in pairwise(sorted(on_axis, reverse=True)):
            middle = (upper + lower) / 2
            inside = self.arc is not None and abs(middle - self.arc.centre_z_mm) < self.arc.radius_mm
            self.sketch.line(
                on_axis[upper],
                on_axis[lower],
                left=self._material("inclusion" if inside else "tissue", middle),
                right=OUTSIDE,
                boundary="axis",
                size_mm=self.inclusion_mm if inside else self.size.face_mm if upper == 0.0 else self.far_mm,
            )
