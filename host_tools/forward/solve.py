"""A scene to its solution: surface deformation w(r), contact pressure p(r), force, and O1-O3.

w is the displacement of the sensing face relative to the probe's own undeformed shape. Everything is linear in the
press, so one solve at 1 mm is scaled to the indentation or force asked for. The baseline is the *same mesh* with the
inclusion made of tissue: separate meshes would put 50 % error on the smallest lumps.
"""

from __future__ import annotations

import os

os.environ.setdefault("NGS_NUM_THREADS", "1")  # a 2-D solve gains nothing from threads, a sweep loses by them

from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np
from ngsolve import BilinearForm, GridFunction, Integrate, SetNumThreads, ngsglobals

from host_tools.forward.contact import Body, bodies, contact_pressure_kpa, integral_over_face, sliding_space
from host_tools.forward.deformation import Deformation, Profile, deformation
from host_tools.forward.elasticity import RING, Stress, section, strain, stress, work
from host_tools.forward.mesh import INCLUSION, TISSUE, Resolution, axisymmetric_mesh
from host_tools.scene import Scene

MN_PER_N = 1e3
"""kPa times mm2 is mN."""
DEFAULT_ORDER = 3
RADII = 221
"""Samples of a profile from the axis to the rim; 0.05 mm apart on the default face."""

ngsglobals.msg_level = 0
SetNumThreads(1)


@dataclass(frozen=True)
class Solution:
    """What one scene does to the probe. Profiles are sampled at `r_mm` from the axis to the rim.

    At the rim itself the pressure is singular: its last sample grows with the mesh and means nothing.
    `contact_force_n` is the integral of the pressure and must equal `force_n`, which comes from the energy.
    """

    r_mm: Profile
    w_mm: Profile
    w_baseline_mm: Profile
    p_kpa: Profile
    p_baseline_kpa: Profile
    force_n: float
    contact_force_n: float
    indentation_mm: float
    baseline_force_n: float
    baseline_indentation_mm: float
    lump: Deformation
    raw: Deformation
    order: int
    elements: int

    @property
    def lump_deformation_mm(self) -> Profile:
        """The lump field: w minus the w of the same press without the inclusion."""
        return self.w_mm - self.w_baseline_mm

    @property
    def pressure_is_positive(self) -> bool:
        """Whether the face is in compression everywhere; if not, closed contact is not the solution."""
        return bool(min(self.p_kpa.min(), self.p_baseline_kpa.min()) > 0)

    def as_record(self) -> dict[str, Any]:
        """Return the solution as the JSON object that `host_tools simulate --json` prints."""
        return {
            "force_n": self.force_n,
            "contact_force_n": self.contact_force_n,
            "indentation_mm": self.indentation_mm,
            **asdict(self.lump),
            "raw": asdict(self.raw),
            "pressure_is_positive": self.pressure_is_positive,
            "plan": {
                "symmetry": "axisymmetric",
                "strain": "small",
                "contact": "closed_sliding",
                "order": self.order,
                "elements": self.elements,
            },
            "r_mm": self.r_mm.tolist(),
            "w_mm": self.w_mm.tolist(),
            "w_baseline_mm": self.w_baseline_mm.tolist(),
            "p_kpa": self.p_kpa.tolist(),
        }


@dataclass(frozen=True)
class _Indented:
    """Solution for 1 mm of indentation, to be scaled."""

    w_mm: Profile
    p_kpa: Profile
    total_mm3: float
    force_n: float
    contact_force_n: float

    def scaled(self, factor: float) -> _Indented:
        return _Indented(*(getattr(self, field.name) * factor for field in fields(self)))


def solve(scene: Scene, *, order: int = DEFAULT_ORDER, resolution: Resolution | None = None) -> Solution:
    """Solve a scene in axisymmetry, small strain, with frictionless closed contact."""
    mesh = axisymmetric_mesh(scene, order=order, resolution=resolution)
    r_mm = np.linspace(0.0, scene.waveguide.radius_mm, RADII)
    baseline = _indent_by_1_mm(mesh, scene, scene.tissue.youngs_modulus_kpa, order, r_mm)
    pressed = baseline
    if scene.has_inclusion and scene.inclusion is not None:
        pressed = _indent_by_1_mm(mesh, scene, scene.inclusion.youngs_modulus_kpa, order, r_mm)
    by, by_baseline = _indentation_mm(scene, pressed), _indentation_mm(scene, baseline)
    pressed, baseline = pressed.scaled(by), baseline.scaled(by_baseline)
    window_mm = scene.waveguide.central_radius_mm
    return Solution(
        r_mm=r_mm,
        w_mm=pressed.w_mm,
        w_baseline_mm=baseline.w_mm,
        p_kpa=pressed.p_kpa,
        p_baseline_kpa=baseline.p_kpa,
        force_n=pressed.force_n,
        contact_force_n=pressed.contact_force_n,
        indentation_mm=by,
        baseline_force_n=baseline.force_n,
        baseline_indentation_mm=by_baseline,
        lump=deformation(
            r_mm, pressed.w_mm - baseline.w_mm, pressed.total_mm3 - baseline.total_mm3, central_radius_mm=window_mm
        ),
        raw=deformation(r_mm, pressed.w_mm, pressed.total_mm3, central_radius_mm=window_mm),
        order=order,
        elements=int(mesh.ne),
    )


def order_difference(scene: Scene, solution: Solution) -> dict[str, float]:
    """Return the relative change of force and O1-O3 when the order is raised by one on the same mesh."""
    finer = solve(scene, order=solution.order + 1)
    pairs = {"force_n": (solution.force_n, finer.force_n)}
    pairs |= {name: (value, asdict(finer.lump)[name]) for name, value in asdict(solution.lump).items()}
    return {name: abs(a - b) / abs(b) if b else 0.0 for name, (a, b) in pairs.items()}


def _indentation_mm(scene: Scene, unit: _Indented) -> float:
    if scene.press.indentation_mm is not None:
        return scene.press.indentation_mm
    assert scene.press.force_n is not None  # Press guarantees one of the two
    return scene.press.force_n / unit.force_n


def _indent_by_1_mm(mesh: Any, scene: Scene, inclusion_modulus_kpa: float, order: int, r_mm: Profile) -> _Indented:
    E = mesh.MaterialCF(
        {
            TISSUE: scene.tissue.youngs_modulus_kpa,
            INCLUSION: inclusion_modulus_kpa,
            **{f"layer{i}": modulus for i, modulus in enumerate(scene.waveguide.layer_moduli_kpa)},
        }
    )
    nu = {TISSUE: scene.tissue.poisson_ratio, INCLUSION: scene.tissue.poisson_ratio}
    nu_cf = mesh.MaterialCF(nu, default=scene.waveguide.poisson_ratio)

    def body_stress(body: Body) -> Stress:
        return stress(strain(body.u_r, body.u_z), E, nu_cf)

    u = _equilibrium(mesh, order, body_stress)
    probe, flesh = bodies(u.components)
    energy = sum(
        Integrate(work(body_stress(b), strain(b.u_r, b.u_z)) * RING * section(b.materials), mesh)
        for b in (probe, flesh)
    )
    pressure = contact_pressure_kpa(mesh, order, body_stress(probe))
    points = [mesh(float(r), 0.0) for r in r_mm]
    return _Indented(
        w_mm=np.array([probe.u_z(point) for point in points]) + 1.0,
        p_kpa=np.array([pressure(point) for point in points]),
        total_mm3=integral_over_face(mesh, probe.u_z + 1.0),
        force_n=float(energy) / MN_PER_N,  # 2 W / delta, exact for a linear body and delta = 1 mm
        contact_force_n=integral_over_face(mesh, pressure) / MN_PER_N,
    )


def _equilibrium(mesh: Any, order: int, body_stress: Any) -> Any:
    """Return the displacement when the back moves 1 mm towards the base: a(u, v) = 0 for every admissible v."""
    space = sliding_space(mesh, order)
    trial, test = space.TnT()
    a = BilinearForm(space, symmetric=True, condense=True)
    for u, v in zip(bodies(trial), bodies(test), strict=True):
        a += work(body_stress(u), strain(v.u_r, v.u_z)) * RING * section(u.materials)
    a.Assemble()
    u_h = GridFunction(space)
    u_h.components[2].Set(-1.0, definedon=mesh.Boundaries("back"))
    inverse = a.mat.Inverse(space.FreeDofs(True), "sparsecholesky")
    rest = u_h.vec.CreateVector()
    rest.data = -a.mat * u_h.vec
    rest.data += a.harmonic_extension_trans * rest
    u_h.vec.data += inverse * rest
    u_h.vec.data += a.inner_solve * rest
    u_h.vec.data += a.harmonic_extension * u_h.vec
    return u_h
