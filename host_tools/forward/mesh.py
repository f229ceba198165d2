"""A scene to a graded axisymmetric mesh; the half plane r > 0 with the sensing face at z = 0, tissue below.

Both rims of the face carry a singularity: the contact rim and the bonded back rim. Left ungraded, the back rim alone
costs 0.3 % of the surface displacement at order 4. The sphere's arc is exact (rational quadratic splines).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate
from typing import Any

from netgen.geom2d import SplineGeometry
from ngsolve import Mesh

from host_tools.scene import Scene

TISSUE, INCLUSION, LAYERS = "tissue", "inclusion", "layer.*"


@dataclass(frozen=True)
class Resolution:
    """Element sizes in mm: bulk, face, both rims, and elements per diameter of the inclusion.

    The defaults hold 0.1 % on O1, O2 and force over the paper's box (`tests/host_tools/forward/test_accuracy.py`).
    """

    bulk_mm: float = 3.0
    face_mm: float = 1.0
    contact_rim_mm: float = 0.01
    back_rim_mm: float = 0.01
    per_inclusion: float = 10.0
    grading: float = 0.4


class _Sketch:
    """Points and lines of the half plane, each with the domains on its left and right."""

    def __init__(self, resolution: Resolution) -> None:
        self.resolution, self.geometry = resolution, SplineGeometry()

    def point(self, r_mm: float, z_mm: float, size_mm: float | None = None) -> int:
        return int(self.geometry.AppendPoint(r_mm, z_mm, maxh=size_mm or self.resolution.bulk_mm))

    def line(self, *points: int, left: int, right: int, boundary: str, size_mm: float | None = None) -> None:
        kind = "line" if len(points) == 2 else "spline3"
        self.geometry.Append(
            [kind, *points],
            leftdomain=left,
            rightdomain=right,
            bc=boundary,
            maxh=size_mm or self.resolution.bulk_mm,
        )


def _draw_tissue(sketch: _Sketch, scene: Scene, centre: int, rim: int) -> None:
    """Draw the slab (domain 1) and in it the half circle of the inclusion (domain 2), if there is one."""
    T, R = scene.tissue.thickness_mm, scene.tissue.half_width_mm
    base, corner, top = sketch.point(0, -T), sketch.point(R, -T), sketch.point(R, 0)
    sketch.line(base, corner, left=1, right=0, boundary="base")
    sketch.line(corner, top, left=1, right=0, boundary="side")
    sketch.line(top, rim, left=1, right=0, boundary="skin")
    sketch.geometry.SetMaterial(1, TISSUE)
    face_mm = sketch.resolution.face_mm
    if not scene.has_inclusion or scene.inclusion is None:
        sketch.line(centre, base, left=1, right=0, boundary="axis", size_mm=face_mm)
        return
    d, h = scene.inclusion.size_mm, scene.inclusion.depth_mm
    a, size_mm = d / 2, min(face_mm, d / sketch.resolution.per_inclusion)
    north, south = sketch.point(0, -h, size_mm), sketch.point(0, -h - d, size_mm)
    east = sketch.point(a, -h - a, size_mm)
    north_east, south_east = sketch.point(a, -h, size_mm), sketch.point(a, -h - d, size_mm)
    sketch.line(centre, north, left=1, right=0, boundary="axis", size_mm=face_mm)
    sketch.line(north, south, left=2, right=0, boundary="axis", size_mm=size_mm)
    sketch.line(south, base, left=1, right=0, boundary="axis")
    sketch.line(south, south_east, east, left=2, right=1, boundary="sphere", size_mm=size_mm)
    sketch.line(east, north_east, north, left=2, right=1, boundary="sphere", size_mm=size_mm)
    sketch.geometry.SetMaterial(2, INCLUSION)


def _draw_waveguide(sketch: _Sketch, scene: Scene, centre: int, rim: int) -> None:
    """Draw the layers (domains 3, 4, ...) upwards from the face."""
    heights = list(accumulate(scene.waveguide.layer_thicknesses_mm))
    inner, outer = centre, rim
    for i, z_mm in enumerate(heights):
        domain, last = 3 + i, i == len(heights) - 1
        up_inner = sketch.point(0, z_mm)
        up_outer = sketch.point(scene.waveguide.radius_mm, z_mm, sketch.resolution.back_rim_mm if last else None)
        sketch.line(outer, up_outer, left=domain, right=0, boundary="wall")
        sketch.line(
            up_outer, up_inner, left=domain, right=0 if last else domain + 1, boundary="back" if last else "bond"
        )
        sketch.line(up_inner, inner, left=domain, right=0, boundary="axis")
        sketch.geometry.SetMaterial(domain, f"layer{i}")
        inner, outer = up_inner, up_outer


def axisymmetric_mesh(scene: Scene, *, order: int, resolution: Resolution | None = None) -> Any:
    """Return the curved mesh: materials tissue, inclusion, layer0...; boundaries face, back, base, axis."""
    sketch = _Sketch(resolution or Resolution())
    face_mm = sketch.resolution.face_mm
    centre = sketch.point(0, 0, face_mm)
    rim = sketch.point(scene.waveguide.radius_mm, 0, sketch.resolution.contact_rim_mm)
    sketch.line(centre, rim, left=3, right=1, boundary="face", size_mm=face_mm)
    _draw_tissue(sketch, scene, centre, rim)
    _draw_waveguide(sketch, scene, centre, rim)
    mesh = Mesh(sketch.geometry.GenerateMesh(maxh=sketch.resolution.bulk_mm, grading=sketch.resolution.grading))
    mesh.Curve(order + 1)
    return mesh
