"""Frictionless closed contact of two glued meshes, without a search and without a parameter.

Probe and tissue share the mesh of the face. One H1 space carries the normal displacement of both, separate spaces the
tangential ones: the face slides but cannot open. For a flat probe in compression this *is* the unilateral solution as
long as the pressure is positive, which every solution checks. Small strain only: in finite strain it neglects slip.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ngsolve import H1, BilinearForm, Compress, GridFunction, Integrate, LinearForm, ds, grad

from host_tools.forward.elasticity import RING, Expression, Strain, Stress, section, work
from host_tools.forward.mesh import INCLUSION, LAYERS, TISSUE

FLESH = f"{TISSUE}|{INCLUSION}"
FACE = ds("face", bonus_intorder=2)


class Body(NamedTuple):
    """One side of the contact: its materials, and its radial and axial displacement."""

    materials: str
    u_r: Expression
    u_z: Expression


def sliding_space(mesh: Any, order: int) -> Any:
    """Return the product space (u_r of the probe, u_r of the tissue, shared u_z), back and base held."""
    probe_r = Compress(H1(mesh, order=order, definedon=mesh.Materials(LAYERS), dirichlet="axis|back"))
    flesh_r = Compress(H1(mesh, order=order, definedon=mesh.Materials(FLESH), dirichlet="axis|base"))
    return probe_r * flesh_r * H1(mesh, order=order, dirichlet="back|base")


def bodies(functions: Any) -> tuple[Body, Body]:
    """Return probe and tissue from the three components of a trial, test or grid function."""
    probe_r, flesh_r, u_z = functions
    return Body(LAYERS, probe_r, u_z), Body(FLESH, flesh_r, u_z)


def contact_pressure_kpa(mesh: Any, order: int, probe_stress: Stress) -> Any:
    """Return the contact pressure on the face as a grid function (kPa, positive in compression).

    Recovered from the probe's residual, int p v dA = int sigma : e(v) dV for every v on the face, so that it balances
    the force exactly; a stress sampled at the face does not, and jumps between elements.
    """
    space = H1(mesh, order=order)  # not only over the probe: points of the face may lie in either side's elements
    p, v = space.TnT()
    residual = LinearForm(space)
    axial_strain = Strain(0, 0, grad(v)[1], grad(v)[0] / 2)
    residual += work(probe_stress, axial_strain) * RING * section(LAYERS)
    residual.Assemble()
    mass = BilinearForm(space, symmetric=True)
    mass += p * v * RING * FACE
    mass.Assemble()
    pressure = GridFunction(space)
    on_face = space.GetDofs(mesh.Boundaries("face"))
    pressure.vec.data = mass.mat.Inverse(on_face, "sparsecholesky") * residual.vec
    return pressure


def integral_over_face(mesh: Any, field: Expression) -> float:
    """Return the integral of a field over the face (field's unit times mm2)."""
    return float(Integrate(field * RING * FACE, mesh))
