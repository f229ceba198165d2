"""A scene to a mesh of fixed topology: one reference mesh whose inclusion is moved and blown up by a smooth map.

Remeshing makes features jump by some 1e-5 when a size or depth changes by a hair (docs/verification.md), and Young's
modulus moves them by less than 5 % over its whole range. The map is taken along rays from the centre of the reference
sphere to the boundary of the slab, which stays where it is; its kinks lie on the two rays to the slab's corners, so
those are lines of the mesh (without them elements fold). Along a ray q(t) = k t / (1 + (k - 1) t) runs from the sphere
(0) to the boundary (1).
"""

from __future__ import annotations

from functools import lru_cache
from math import atan2, pi, tan
from typing import Any, NamedTuple

import numpy as np
from ngsolve import CF, TRIG, VOL, Det, Grad, GridFunction, Id, IfPos, IntegrationRule, Mesh, Parameter, VectorH1, x, y
from ngsolve import sqrt as sqrt_cf

from device.measurement.quantities import Inclusion
from host_tools.forward.materials import FLESH, LAYERS
from host_tools.forward.meshes.mesh import Resolution
from host_tools.forward.meshes.sketch import OUTSIDE, Arc, Sketch, draw_waveguide
from host_tools.scenes.scene import Scene, Waveguide

REFERENCE_RADIUS_RATIO, REFERENCE_DEPTH_RATIO = 0.09, 0.4
"""The reference sphere's radius and its centre's depth, over the thickness of the slab."""
SIZE_RATIO, DEPTH_RATIO = (2 / 30, 15 / 30), (4 / 30, 12 / 30)
"""Inclusions that the map reaches, over the slab's thickness: 2-15 mm wide and 4-12 mm deep in the default slab."""
THIN_SLAB_RATIO = 100.0
"""Half width over thickness above which the reference mesh cannot be made."""
WIDE_SLAB_RATIO = 1.5
"""The slab must be at least so much wider (half width) than thick, or the side rays become too short."""


class _Slab(NamedTuple):
    thickness_mm: float
    half_width_mm: float

    @property
    def arc(self) -> Arc:
        """The reference sphere."""
        return Arc(-REFERENCE_DEPTH_RATIO * self.thickness_mm, REFERENCE_RADIUS_RATIO * self.thickness_mm)

    @property
    def corner_angles(self) -> tuple[float, float]:
        """Elevations of the rays from the reference centre to the lower and the upper corner."""
        c = self.arc.centre_z_mm
        return atan2(-self.thickness_mm - c, self.half_width_mm), atan2(-c, self.half_width_mm)


def reaches(scene: Scene) -> bool:
    """Return whether the fixed topology serves a scene: a centred sphere in a wide homogeneous slab, in the box."""
    if scene.inclusion is None or scene.tissue.layers or not scene.placement.is_sphere:
        return False
    T = scene.tissue.thickness_mm
    size, depth = scene.inclusion.size_mm / T, scene.inclusion.depth_mm / T
    inside = SIZE_RATIO[0] <= size <= SIZE_RATIO[1] and DEPTH_RATIO[0] <= depth <= DEPTH_RATIO[1]
    return inside and WIDE_SLAB_RATIO <= scene.tissue.half_width_mm / T <= THIN_SLAB_RATIO


def morphed_mesh(scene: Scene, *, order: int, resolution: Resolution | None = None) -> Any:
    """Return the reference mesh deformed to a scene that it `reaches`.

    It is one mesh for all scenes of a slab and probe: the next call moves it. Points are looked up in reference
    coordinates; on the face and in the waveguide these are the real ones.
    """
    return _moved(scene, order, resolution or Resolution()).mesh


def smallest_jacobian(scene: Scene, *, order: int = 3, resolution: Resolution | None = None) -> float:
    """Return the least local change of volume of a scene's map; the mesh folds where it is not positive."""
    return _moved(scene, order, resolution or Resolution()).smallest_jacobian()


def _moved(scene: Scene, order: int, size: Resolution) -> _ReferenceMesh:
    if scene.inclusion is None:
        raise ValueError("a scene without an inclusion has nothing to morph: use axisymmetric_mesh")
    slab = _Slab(scene.tissue.thickness_mm, scene.tissue.half_width_mm)
    reference = _reference(scene.waveguide, slab, order, size)
    reference.move_to(scene.inclusion)
    return reference


@lru_cache(maxsize=8)
def _reference(waveguide: Waveguide, slab: _Slab, order: int, size: Resolution) -> _ReferenceMesh:
    return _ReferenceMesh(waveguide, slab, order, size)


class _ReferenceMesh:
    def __init__(self, waveguide: Waveguide, slab: _Slab, order: int, size: Resolution) -> None:
        self.arc = slab.arc
        self.mesh = Mesh(_draw(waveguide, slab, size).mesh(size.grading))
        self.mesh.Curve(order + 1)
        self.displacement = GridFunction(VectorH1(self.mesh, order=order + 1))
        self.radius_mm, self.centre_z_mm = Parameter(self.arc.radius_mm), Parameter(self.arc.centre_z_mm)
        self.map = self._map(slab)
        in_waveguide = self.displacement.space.GetDofs(self.mesh.Materials(LAYERS))
        self.fixed = np.flatnonzero(np.array(list(in_waveguide), dtype=bool))

    def _map(self, slab: _Slab) -> Any:
        """Return the displacement of every reference point, as a function of the two parameters."""
        a0, c0 = self.arc.radius_mm, self.arc.centre_z_mm
        r, z = x, y - c0
        rho = sqrt_cf(r * r + z * z) + 1e-300
        e_r, e_z = r / rho, z / rho
        low, high = (tan(angle) for angle in slab.corner_angles)
        hair, tiny = 1e-9 * slab.half_width_mm, 1e-30
        to_top, to_base = -c0 / (e_z + tiny), -(slab.thickness_mm + c0) / (e_z - tiny)
        to_side = slab.half_width_mm / (e_r + tiny)
        reach = IfPos(z - high * r - hair, to_top, IfPos(low * r - z - hair, to_base, to_side))
        t, k = (rho - a0) / (reach - a0), sqrt_cf(self.radius_mm / a0)
        q = k * t / (1 + (k - 1) * t)
        outside = (
            (1 - q) * self.radius_mm * e_r + q * reach * e_r - x,
            (1 - q) * (self.centre_z_mm + self.radius_mm * e_z) + q * (c0 + reach * e_z) - y,
        )
        growth = self.radius_mm / a0
        inside = (growth * r - x, self.centre_z_mm + growth * z - y)
        return self.mesh.MaterialCF({"tissue0": CF(outside), "inclusion0": CF(inside)}, default=CF((0, 0)))

    def move_to(self, inclusion: Inclusion) -> None:
        self.radius_mm.Set(inclusion.size_mm / 2)
        self.centre_z_mm.Set(-inclusion.depth_mm - inclusion.size_mm / 2)
        self.mesh.UnsetDeformation()
        self.displacement.Set(self.map, definedon=self.mesh.Materials(FLESH))
        self.displacement.vec.FV().NumPy()[self.fixed] = 0.0
        self.mesh.SetDeformation(self.displacement)

    def smallest_jacobian(self) -> float:
        """Return the smallest determinant of the map's gradient, at the points of order 8: above 0 it folds nowhere."""
        self.mesh.UnsetDeformation()
        points = self.mesh.MapToAllElements(IntegrationRule(TRIG, 8), VOL)
        jacobian = Det(Grad(self.displacement) + Id(2))(points)
        self.mesh.SetDeformation(self.displacement)
        return float(np.min(jacobian))


def _draw(waveguide: Waveguide, slab: _Slab, size: Resolution) -> Sketch:
    """Draw the slab in three regions parted by the rays to its corners, the reference sphere, and the probe."""
    sketch, T, R = Sketch(size.bulk_mm), slab.thickness_mm, slab.half_width_mm
    arc_mm = min(size.face_mm, 2 * slab.arc.radius_mm / size.per_inclusion)
    centre = sketch.point(0, 0, size.face_mm)
    rim = sketch.point(waveguide.radius_mm, 0, size.contact_rim_mm)
    base, low, high = sketch.point(0, -T), sketch.point(R, -T), sketch.point(R, 0)
    angles = [-pi / 2, *slab.corner_angles, pi / 2]
    south, to_low, to_high, north = on_arc = [sketch.point(*slab.arc.at(angle), arc_mm) for angle in angles]
    below, beside, above = regions = ["tissue0/below", "tissue0/beside", "tissue0/above"]
    sketch.line(centre, rim, left="layer0", right=above, boundary="face", size_mm=size.face_mm)
    sketch.line(high, rim, left=above, right=OUTSIDE, boundary="skin")
    sketch.line(low, high, left=beside, right=OUTSIDE, boundary="side")
    sketch.line(base, low, left=below, right=OUTSIDE, boundary="base")
    sketch.line(centre, north, left=above, right=OUTSIDE, boundary="axis", size_mm=size.face_mm)
    sketch.line(north, south, left="inclusion0", right=OUTSIDE, boundary="axis", size_mm=arc_mm)
    sketch.line(south, base, left=below, right=OUTSIDE, boundary="axis")
    sketch.line(to_high, high, left=above, right=beside, boundary="ray")
    sketch.line(to_low, low, left=beside, right=below, boundary="ray")
    sketch.arc(slab.arc, angles, on_arc, left=["inclusion0"] * 3, right=regions, size_mm=arc_mm)
    draw_waveguide(sketch, waveguide, centre, rim, size.back_rim_mm)
    return sketch
