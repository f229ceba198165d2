"""Convergence on the real scene, where both rims of the probe are singular: with elements graded to them and without.

No exact solution: the reference is order 5 on a mesh finer than every level of the model.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from device.measurement.quantities import Inclusion
from host_tools.forward.deformation import deformation
from host_tools.forward.face_state import Rays
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import AXISYMMETRIC
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_most
from host_tools.scenes.scene import Scene

SCENE = Scene(Inclusion(10.0, 6.0, 80.0))
SIZES_MM = (4.0, 2.0, 1.0)
RIM_RATIO = 0.01
"""Elements at the rims over those of the bulk on the graded meshes: it stays, so that a halving halves them all."""
REFERENCE = (Resolution(1.5, 0.5, 0.001, 0.001, per_inclusion=20.0, grading=0.3), 5)


class SceneFeatures(NamedTuple):
    """Force and inclusion field of the unit press."""

    force: float
    max_deformation: float
    central_deformation: float


class Solved(NamedTuple):
    """The features of one mesh and order, and the number of unknowns."""

    features: SceneFeatures
    unknowns: int


def solve_level(resolution: Resolution, order: int, scene: Scene = SCENE) -> Solved:
    """Press a scene by 1 mm on a mesh of given element sizes."""
    mesh, rays = axisymmetric_mesh(scene, order=order, resolution=resolution), Rays.over(scene.waveguide)
    press, sampler = LinearPress(mesh, AXISYMMETRIC, order), FaceSampler(mesh, rays, "axisymmetric")
    inclusion_free, inclusion = (
        press.face_state(press.displacement(m), m, sampler) for m in (baseline(scene), with_inclusion(scene))
    )
    field = deformation(rays.r_mm, inclusion.w_mm - inclusion_free.w_mm, inclusion.total_mm3 - inclusion_free.total_mm3)
    features = SceneFeatures(inclusion.force_n, field.max_deformation_mm, field.central_deformation_mm3)
    return Solved(features, press.contact.space.ndof)


def uniform(size_mm: float) -> Resolution:
    """Return elements of one size everywhere."""
    return Resolution(size_mm, size_mm, size_mm, size_mm, per_inclusion=10.0 / size_mm)


def graded(size_mm: float) -> Resolution:
    """Return the same bulk with elements a hundred times smaller at both rims."""
    rim_mm = RIM_RATIO * size_mm
    return Resolution(size_mm, size_mm, rim_mm, rim_mm, per_inclusion=10.0 / size_mm)


Meshes = dict[tuple[str, int], list[Solved]]
KINDS: dict[str, Callable[[float], Resolution]] = {"uniform": uniform, "graded": graded}


def measurements(orders: tuple[int, ...] = (1, 2, 3, 4), sizes_mm: tuple[float, ...] = SIZES_MM) -> Meshes:
    """Return the solutions of both kinds of mesh, order by order, one a size."""
    return {
        (kind, order): [solve_level(resolution(size), order) for size in sizes_mm]
        for kind, resolution in KINDS.items()
        for order in orders
    }


def errors(found: list[Solved], reference: SceneFeatures) -> list[SceneFeatures]:
    """Return the relative errors of the features."""
    return [SceneFeatures(*np.abs(np.divide(solved.features, reference) - 1).tolist()) for solved in found]


def benchmarks(found: Meshes, reference: SceneFeatures) -> tuple[Benchmark, ...]:
    """Return the errors of order 3 on the finest graded mesh, which is of the data sets' fineness."""
    finest = errors(found["graded", 3], reference)[-1]
    case = f"graded, p = 3, {SIZES_MM[-1]:g} mm"
    return tuple(at_most(case, f"relative error of {name}", e, 1e-3) for name, e in finest._asdict().items())


def _table(found: Meshes, reference: SceneFeatures) -> Table:
    rows = []
    for (kind, order), solved in found.items():
        off = errors(solved, reference)
        rate = np.log2(np.divide(off[-2], off[-1]))
        cells = [f"{e.force:.1e} / {e.max_deformation:.1e}" for e in off]
        rows.append((f"{kind}, p = {order}", *cells, f"{rate[0]:.1f} / {rate[1]:.1f}", str(solved[-1].unknowns)))
    header = ("mesh", *(f"{size:g} mm" for size in SIZES_MM), "last rate", "unknowns")
    return Table("Relative error of force / of O1 by element size", header, tuple(rows))


def _figure(found: Meshes, reference: SceneFeatures) -> Figure:
    def draw(figure: Any) -> None:
        for panel, axes in zip(range(2), figure.subplots(1, 2), strict=True):
            for (kind, order), solved in found.items():
                off = [error[panel] for error in errors(solved, reference)]
                line = {"uniform": "o--", "graded": "s-"}[kind]
                axes.loglog([s.unknowns for s in solved], off, line, color=f"C{order}", label=f"{kind}, p = {order}")
            axes.set_xlabel("unknowns")
            axes.set_ylabel(("relative error of the force", "relative error of O1")[panel])
            axes.grid(alpha=0.3)
        axes.legend(fontsize="small")

    return Figure("verification_scene_rates.svg", "The default scene: error against unknowns", draw)


def chapter(short: bool) -> Chapter:
    """Return the chapter: orders 1 and 3 only when short."""
    found, reference = measurements((1, 3) if short else (1, 2, 3, 4)), solve_level(*REFERENCE).features
    return Chapter(
        "Rates of convergence, the real scene",
        "Inclusion of 10 mm, 6 mm deep, 80 kPa, pressed by 1 mm; the reference is order 5 with elements of 0.001 mm at "
        "the rims.",
        "Ciarlet, The Finite Element Method (1978), section 3.2; Schwab, p- and hp-Finite Element Methods (1998).",
        benchmarks(found, reference),
        (_table(found, reference),),
        (_figure(found, reference),),
    )
