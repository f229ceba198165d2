"""Hertz: a rigid paraboloid on a half-space through the domed face's unilateral contact.

The slab is finite, so force, contact radius and peak pressure exceed Hertz's by a share in proportion to a/L; two
slabs, the second twice as large, give the half-space by extrapolation. Source: Johnson, Contact Mechanics (1985),
sections 3.4 and 4.2.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import NamedTuple

import numpy as np

from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.materials import baseline
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.domed_press import DomedModel
from host_tools.forward.symmetry import AXISYMMETRIC
from host_tools.pages.benchmark import Benchmark, Chapter, Table, relative
from host_tools.scenes.scene import Press, Scene, Tissue, Waveguide

RADIUS_OF_CURVATURE_MM, INDENTATION_MM, FACE_MM = 100.0, 0.04, 3.0
E_KPA, NU, ORDER = 5.0, 0.3, 3
CONTACT_MM = sqrt(RADIUS_OF_CURVATURE_MM * INDENTATION_MM)
EFFECTIVE_KPA = E_KPA / (1 - NU**2)
SLABS_MM = (25.0, 50.0, 100.0)
"""Thickness and half width of the slab."""
SAFELY_PRESSED = 0.3
"""Hertz's ellipse is fitted where the pressure is above this share of its peak: at its edge one element blurs it."""


class Hertz(NamedTuple):
    """Force, contact radius and peak pressure over Hertz's."""

    force: float
    radius: float
    peak_pressure: float


def pressed(slab_mm: float) -> Hertz:
    """Return what a slab of finite size gives, over what the half-space would."""
    dome_mm = FACE_MM**2 / (2 * RADIUS_OF_CURVATURE_MM)
    probe = Waveguide(FACE_MM, (2.0,), (1e6,), poisson_ratio=0.3, dome_mm=dome_mm)
    scene = Scene(None, Press(indentation_mm=INDENTATION_MM), probe, Tissue(E_KPA, slab_mm, slab_mm, NU))
    sizes = Resolution(slab_mm / 8, CONTACT_MM / 10, 0.5, 0.5, grading=0.3)
    mesh, rays = axisymmetric_mesh(scene, order=ORDER, resolution=sizes), Rays.over(probe)
    model = DomedModel(
        mesh,
        AXISYMMETRIC,
        FaceSampler(mesh, rays, "axisymmetric"),
        order=ORDER,
        other_order=ORDER + 1,
        mixed=False,
        curvature_per_mm=dome_mm / FACE_MM**2,
    )
    face = model.press(baseline(scene), [scene.press], estimate_error=False)[0].state
    force_n = 4 / 3 * EFFECTIVE_KPA * sqrt(RADIUS_OF_CURVATURE_MM) * INDENTATION_MM**1.5 / 1e3
    radius_mm, peak_kpa = _ellipse(rays, face)
    hertz_peak_kpa = 2 * EFFECTIVE_KPA * CONTACT_MM / (pi * RADIUS_OF_CURVATURE_MM)
    return Hertz(face.force_n / force_n, radius_mm / CONTACT_MM, peak_kpa / hertz_peak_kpa)


def _ellipse(rays: Rays, face: FaceState) -> tuple[float, float]:
    """Fit p^2 = p0^2 (1 - r^2/a^2); return a (mm) and p0 (kPa)."""
    r_mm, p_kpa = rays.r_mm[0], face.p_kpa[0]
    inner = p_kpa > SAFELY_PRESSED * p_kpa.max()
    slope, intercept = np.polyfit(r_mm[inner] ** 2, p_kpa[inner] ** 2, 1)
    return float(np.sqrt(-intercept / slope)), float(np.sqrt(intercept))


def measurements() -> dict[float, Hertz]:
    """Return the ratios to Hertz by the size of the slab."""
    return {slab_mm: pressed(slab_mm) for slab_mm in SLABS_MM}


def benchmarks(found: dict[float, Hertz]) -> tuple[Benchmark, ...]:
    """Return the half-space's ratios, extrapolated from the last two slabs (the second twice the first)."""
    small, large = list(found.values())[-2:]
    names = ("force / Hertz", "contact radius / Hertz", "peak pressure / Hertz")
    return tuple(
        relative("L to infinity", name, 2 * b - a, 1.0, 2e-3) for name, a, b in zip(names, small, large, strict=True)
    )


def chapter(short: bool) -> Chapter:
    """Return the chapter; a short one is the same."""
    found = measurements()
    rows = [
        (
            f"{slab:g}",
            f"{slab / CONTACT_MM:g}",
            *(f"{value - 1:+.4f}" for value in ratios),
            f"{(ratios.force - 1) * slab / CONTACT_MM:.2f}",
        )
        for slab, ratios in found.items()
    ]
    header = ("L (mm)", "L/a", "force - 1", "radius - 1", "peak pressure - 1", "(force - 1) L/a")
    return Chapter(
        "Rigid paraboloid on a half-space (Hertz)",
        "P = 4/3 E* sqrt(R) delta^1.5, a = sqrt(R delta), p0 = 2 E* a / (pi R), by the unilateral contact of the domed "
        "face (penalty, Newton).",
        "Hertz (1882); Johnson, Contact Mechanics (1985), sections 3.4 and 4.2.",
        benchmarks(found),
        (Table("Departure from Hertz by the size of the slab", header, tuple(rows)),),
    )
