"""The incompressible limit: displacements alone lock, displacement with discontinuous pressure does not.

Source: Hughes, The Finite Element Method (1987), sections 4.3-4.4.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

from device.measurement.quantities import Inclusion
from host_tools.forward.face_state import Rays
from host_tools.forward.materials import with_inclusion
from host_tools.forward.meshes.mesh import axisymmetric_mesh
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import AXISYMMETRIC
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_least, relative
from host_tools.scenes.scene import Placement, Scene, Tissue, Waveguide

POISSON_RATIOS = (0.49, 0.499, 0.4999, 0.49999, 0.499999, 0.4999999)
SCENE = Scene(Inclusion(10.0, 6.0, 80.0))


class Formulation(NamedTuple):
    """Order, and whether a pressure is an unknown."""

    order: int
    mixed: bool

    def __str__(self) -> str:
        return f"p = {self.order}, {'mixed' if self.mixed else 'displacement'}"


FORMULATIONS = (*(Formulation(order, mixed=False) for order in (1, 2, 3, 4)), *(Formulation(p, True) for p in (3, 4)))


class Pressed(NamedTuple):
    """Displacement of the middle of the face (mm) and force (N) per mm of indentation."""

    w0_mm: float
    force_n: float


def pressed(formulation: Formulation, nu: float) -> Pressed:
    """Press the scene, every material of one Poisson ratio, on the mesh of the data sets."""
    scene = replace(
        SCENE,
        waveguide=Waveguide(poisson_ratio=nu),
        tissue=Tissue(poisson_ratio=nu),
        placement=Placement(poisson_ratio=nu),
    )
    mesh = axisymmetric_mesh(scene, order=formulation.order)
    press = LinearPress(mesh, AXISYMMETRIC, formulation.order, mixed=formulation.mixed)
    materials = with_inclusion(scene)
    sampler = FaceSampler(mesh, Rays.over(scene.waveguide), "axisymmetric")
    face = press.face_state(press.displacement(materials), materials, sampler)
    return Pressed(float(face.w_mm[0, 0]), face.force_n)


LockingFound = dict[Formulation, list[Pressed]]


def measurements(formulations: tuple[Formulation, ...] = FORMULATIONS) -> LockingFound:
    """Return the presses of every formulation, one a Poisson ratio."""
    return {formulation: [pressed(formulation, nu) for nu in POISSON_RATIOS] for formulation in formulations}


def benchmarks(found: LockingFound) -> tuple[Benchmark, ...]:
    """Return how far the mixed formulation still moves at the limit, its order's error, and that p = 1 locks."""
    mixed, locked = found[Formulation(3, True)], found[Formulation(1, False)]
    case = f"mixed p = 3, nu = {POISSON_RATIOS[-1]:.7g}"
    settled = [
        relative(case, f"{name}, against nu = {POISSON_RATIOS[-2]:.7g}", last, before, 1e-5)
        for name, last, before in zip(("w0 (mm)", "force (N)"), mixed[-1], mixed[-2], strict=True)
    ]
    if (finer := found.get(Formulation(4, True))) is not None:
        settled += [
            relative(case, f"{name}, against p = 4", value, fine, 1e-3)
            for name, value, fine in zip(("w0 (mm)", "force (N)"), mixed[-1], finer[-1], strict=True)
        ]
    stiffness = locked[-1].force_n / mixed[-1].force_n
    return (*settled, at_least("displacement p = 1, same nu", "force over the mixed one: it locks", stiffness, 10.0))


def _table(found: LockingFound) -> Table:
    rows = [(str(how), *(f"{p.w0_mm:.5f} / {p.force_n:.5f}" for p in faces)) for how, faces in found.items()]
    header = ("formulation", *(f"nu = {nu:.7g}" for nu in POISSON_RATIOS))
    return Table("w0 (mm) / force (N) per mm of indentation", header, tuple(rows))


def _figure(found: LockingFound) -> Figure:
    def draw(figure: Any) -> None:
        axes = figure.subplots()
        to_limit = [1 - 2 * nu for nu in POISSON_RATIOS]
        for how, faces in found.items():
            axes.loglog(to_limit, [p.force_n for p in faces], "s--" if how.mixed else "o-", label=str(how))
        axes.invert_xaxis()
        axes.set_ylim(0.1, 10)
        axes.set_xlabel("1 - 2 nu")
        axes.set_ylabel("force at 1 mm (N)")
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small")

    return Figure(
        "verification_locking.svg", "Force on the way to incompressibility: what locks and what does not", draw
    )


def chapter(short: bool) -> Chapter:
    """Return the chapter: only p = 1 and mixed p = 3 when short."""
    found = measurements((Formulation(1, False), Formulation(3, True)) if short else FORMULATIONS)
    return Chapter(
        "Incompressible limit",
        "Every material's Poisson ratio goes to one half.",
        "Hughes, The Finite Element Method (1987), sections 4.3-4.4.",
        benchmarks(found),
        (_table(found),),
        (_figure(found),),
    )
