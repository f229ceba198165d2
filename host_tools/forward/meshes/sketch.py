"""Points, lines and arcs of the half plane r > 0, each line with the materials on its left and right.

Arcs are exact: a rational quadratic spline through two points of a circle, with the control point where their tangents
meet, is the circle, and stretching its radii makes it an ellipse. Source: Piegl & Tiller, The NURBS Book, section 7.3.
"""

from __future__ import annotations

from itertools import accumulate, pairwise
from math import cos, pi, sin
from typing import Any, NamedTuple

from netgen.geom2d import SplineGeometry

from host_tools.scenes.scene import Waveguide

OUTSIDE = ""
"""The material of what is not meshed."""


class Arc(NamedTuple):
    """Half of a spheroid's meridian: centre on the axis, vertical semi-axis, horizontal over vertical."""

    centre_z_mm: float
    radius_mm: float
    width_ratio: float = 1.0

    def at(self, angle: float, reach: float = 1.0) -> tuple[float, float]:
        """Return (r, z) at an angle from the equator, `reach` times as far out as the arc."""
        r, z = self.radius_mm * cos(angle) * reach, self.radius_mm * sin(angle) * reach
        return (0.0 if abs(angle) == pi / 2 else r * self.width_ratio), self.centre_z_mm + z


class Sketch:
    """A drawing that becomes a mesh; `bulk_mm` is the element size where none is given.

    Regions of one material that a line must part are told apart after a slash: `tissue0/above`, `tissue0/below`.
    """

    def __init__(self, bulk_mm: float) -> None:
        self.bulk_mm, self.geometry = bulk_mm, SplineGeometry()
        self._domains: dict[str, int] = {OUTSIDE: 0}

    def point(self, r_mm: float, z_mm: float, size_mm: float | None = None, *, layered: bool = False) -> int:
        """Add a point, with the element size there; towards a layered one the mesh can be refined geometrically."""
        return int(self.geometry.AppendPoint(r_mm, z_mm, maxh=size_mm or self.bulk_mm, hpref=float(layered)))

    def line(self, *points: int, left: str, right: str, boundary: str, size_mm: float | None = None) -> None:
        """Add a straight line of two points, or an arc of three whose middle one is the control point."""
        self.geometry.Append(
            ["line" if len(points) == 2 else "spline3", *points],
            leftdomain=self._domain(left),
            rightdomain=self._domain(right),
            bc=boundary,
            maxh=size_mm or self.bulk_mm,
        )

    def arc(
        self, arc: Arc, angles: list[float], points: list[int], *, left: list[str], right: list[str], size_mm: float
    ) -> None:
        """Add the arc piece by piece from angle to angle (ascending), each piece with its own materials."""
        for i, (start, stop) in enumerate(pairwise(angles)):
            control = self.point(*arc.at((start + stop) / 2, 1 / cos((stop - start) / 2)), size_mm)
            self.line(
                points[i], control, points[i + 1], left=left[i], right=right[i], boundary="sphere", size_mm=size_mm
            )

    def _domain(self, region: str) -> int:
        if region not in self._domains:
            self._domains[region] = len(self._domains)
            self.geometry.SetMaterial(self._domains[region], region.partition("/")[0])
        return self._domains[region]

    def mesh(self, grading: float, far_mm: float | None = None) -> Any:
        """Return the netgen mesh, whose elements are nowhere larger than `far_mm`, or else `bulk_mm`."""
        return self.geometry.GenerateMesh(maxh=far_mm or self.bulk_mm, grading=grading)


def draw_waveguide(
    sketch: Sketch, waveguide: Waveguide, centre: int, rim: int, back_rim_mm: float, *, layered: bool = False
) -> None:
    """Draw the layers upwards from the face, whose end points are given; the face itself is the caller's."""
    inner, outer = centre, rim
    heights = list(accumulate(waveguide.layer_thicknesses_mm))
    for i, z_mm in enumerate(heights):
        material, last = f"layer{i}", i == len(heights) - 1
        up_inner = sketch.point(0, z_mm)
        up_outer = sketch.point(waveguide.radius_mm, z_mm, back_rim_mm if last else None, layered=layered and last)
        above, name = (OUTSIDE, "back") if last else (f"layer{i + 1}", "bond")
        sketch.line(outer, up_outer, left=material, right=OUTSIDE, boundary="wall")
        sketch.line(up_outer, up_inner, left=material, right=above, boundary=name)
        sketch.line(up_inner, inner, left=material, right=OUTSIDE, boundary="axis")
        inner, outer = up_inner, up_outer
