"""Balance laws: force, energy and pressure must agree whatever the mesh, in small strain and in finite strain.

Small strain: 2 W / delta is the force (Clapeyron). Finite strain: the stored energy is the work of the force over the
ramp. Source: Gurtin, An Introduction to Continuum Mechanics (1981), sections 27-28.
"""

from __future__ import annotations

import numpy as np
from ngsolve import BaseVector, BilinearForm, GridFunction, InnerProduct

from device.measurement.quantities import Inclusion
from host_tools.forward.face_state import MN_PER_N, Rays
from host_tools.forward.finite_strain.load_path import press_along
from host_tools.forward.finite_strain.loaded_face import LoadedFace
from host_tools.forward.materials import Elasticity, with_inclusion
from host_tools.forward.meshes.mesh import axisymmetric_mesh
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import AXISYMMETRIC
from host_tools.forward.tiers import AXISYMMETRIC_SIZES
from host_tools.pages.benchmark import Benchmark, Chapter, relative
from host_tools.scenes.scene import Scene

SCENE = Scene(Inclusion(10.0, 6.0, 80.0))
RAMP_MM = (0.25, 0.5, 0.75, 1.0)
EDGE_FORCE = "sliding_with_edge_force"
WORK_BOUNDS = {EDGE_FORCE: 1e-4, "sliding": 1e-3}
"""Pairing closes to 1e-7. Sliding does so only to some 1e-5: labels are spread anew after each step. The default holds
the slip of the rim at its linear rate, and what holds it does work of second order in the press: the force of the edge.
"""


def linear_balance(order: int = 3) -> tuple[Benchmark, ...]:
    """Return energy, pressure and both reactions of a linear press against one another."""
    mesh = axisymmetric_mesh(SCENE, order=order)
    press, materials = LinearPress(mesh, AXISYMMETRIC, order), with_inclusion(SCENE)
    u = press.displacement(materials)
    face = press.face_state(u, materials, FaceSampler(mesh, Rays.over(SCENE.waveguide), "axisymmetric"))
    residual = _residual(press, materials, u)
    back_n, base_n = (_reaction_n(press, residual, boundary) for boundary in ("back", "base"))
    energy_n = float(InnerProduct(residual, u.vec)) / MN_PER_N  # the back has moved by 1 mm
    case = f"small strain, p = {order}"
    return (
        relative(case, "2 W / delta against the force (N)", energy_n, face.force_n, 1e-8),
        relative(case, "integral of the recovered pressure (N)", face.contact_force_n, -back_n, 1e-8),
        relative(case, "reaction of the base (N)", base_n, -back_n, 1e-8),
    )


def _residual(press: LinearPress, materials: Elasticity, u: GridFunction) -> BaseVector:
    """Return the residual of the equations (mN): zero in equilibrium, but where a boundary is held."""
    space = press.contact.space
    form = BilinearForm(space, symmetric=True)
    for term in press.weak_form(materials, *space.TnT()):
        form += term
    form.Assemble()
    residual = u.vec.CreateVector()
    residual.data = form.mat * u.vec
    return residual


def _reaction_n(press: LinearPress, residual: BaseVector, boundary: str) -> float:
    """Return the axial force (N) of a held boundary on its body."""
    lift = GridFunction(press.contact.space)
    lift.components[press.contact.normal_indices[0]].Set(1.0, definedon=press.mesh.Boundaries(boundary))
    return float(InnerProduct(residual, lift.vec)) / MN_PER_N


def finite_ramp(contact: str, indentations_mm: tuple[float, ...] = RAMP_MM) -> tuple[LoadedFace, ...]:
    """Return the faces of a ramp in finite strain; `contact` is a name of `WORK_BOUNDS`."""
    mesh = axisymmetric_mesh(SCENE, order=3, resolution=AXISYMMETRIC_SIZES["blunt"])
    return press_along(
        mesh,
        with_inclusion(SCENE),
        indentations_mm,
        order=3,
        rays=Rays.over(SCENE.waveguide),
        edge_force=contact == EDGE_FORCE,
    )


def finite_balance(contact: str) -> tuple[Benchmark, ...]:
    """Return work against stored energy, and the forces of face and base against that of the back."""
    ramp = finite_ramp(contact)
    last, case = ramp[-1], f"finite strain, {contact}"
    delta_mm = np.array([0.0, *(loaded.face.indentation_mm for loaded in ramp)])
    force_mn = MN_PER_N * np.array([0.0, *(loaded.face.force_n for loaded in ramp)])
    force_law = np.polynomial.Polynomial.fit(delta_mm, force_mn, len(ramp))
    work_uj = float(force_law.integ()(delta_mm[-1]) - force_law.integ()(0.0))
    return (
        relative(case, f"work of the force to {delta_mm[-1]:g} mm (uJ)", work_uj, last.energy_uj, WORK_BOUNDS[contact]),
        relative(case, "integral of the recovered pressure (N)", last.face.contact_force_n, last.face.force_n, 1e-6),
        relative(case, "reaction of the base (N)", last.base_force_n, last.face.force_n, 1e-6),
    )


def chapter(short: bool) -> Chapter:
    """Return the chapter: small strain only when short."""
    finite = () if short else tuple(row for contact in WORK_BOUNDS for row in finite_balance(contact))
    return Chapter(
        "Balance of force and energy",
        "The default inclusion, pressed by 1 mm.",
        "Clapeyron; Gurtin, An Introduction to Continuum Mechanics (1981), sections 27-28.",
        (*linear_balance(), *finite),
        facts={"loads": len(RAMP_MM)},
    )
