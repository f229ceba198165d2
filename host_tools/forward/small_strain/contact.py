"""Frictionless contact of two glued meshes, without a search: closed (shared normal displacement) or with a gap.

Probe and tissue share the mesh of the face and have separate tangential displacements: the face slides. With one
shared normal displacement it cannot open, which for a flat probe in compression *is* the unilateral solution as long
as the pressure is positive; every solution checks that. Small strain only: in finite strain it neglects slip.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ngsolve import H1, L2, BilinearForm, Compress, GridFunction, Integrate, LinearForm, ds

from host_tools.forward.materials import FLESH, LAYERS
from host_tools.forward.small_strain.elasticity import Stress, work
from host_tools.forward.symmetry import Expression, Symmetry

HIGH_ORDERS = 16
"""Added to the order 5 of NGSolve's own integrals, which cut fields of order 7 and above short by 0.1-5 %."""


class Body(NamedTuple):
    """One side of the contact: its materials and its displacement components, the normal one last."""

    materials: str
    u: tuple[Expression, ...]


class ContactSpace:
    """The unknowns of both bodies: tangential displacements each its own, the normal one shared or also split."""

    def __init__(self, mesh: Any, symmetry: Symmetry, order: int, *, closed: bool = True, mixed: bool = False) -> None:
        self.mesh, self.symmetry, self.order = mesh, symmetry, order
        self.tangential, self.closed, self.mixed = len(symmetry.held), closed, mixed
        spaces = [self._one_body(LAYERS, f"{held}|back") for held in symmetry.held]
        spaces += [self._one_body(FLESH, f"{held}|base") for held in symmetry.held]
        if closed:
            spaces.append(H1(mesh, order=order, dirichlet="back|base"))
        else:
            spaces += [self._one_body(LAYERS, "back"), self._one_body(FLESH, "base")]
        if mixed:
            spaces.append(L2(mesh, order=order - 1))
        self.space = spaces[0]
        for space in spaces[1:]:
            self.space = self.space * space

    def _one_body(self, materials: str, dirichlet: str) -> Any:
        space = H1(self.mesh, order=self.order, definedon=self.mesh.Materials(materials), dirichlet=dirichlet)
        return Compress(space)

    def bodies(self, functions: Any) -> tuple[Body, Body]:
        """Return probe and tissue from the components of a trial, test or grid function."""
        n = self.tangential
        probe_z, flesh_z = (functions[2 * n],) * 2 if self.closed else functions[2 * n : 2 * n + 2]
        return Body(LAYERS, (*functions[:n], probe_z)), Body(FLESH, (*functions[n : 2 * n], flesh_z))

    def pressure(self, functions: Any) -> Expression | None:
        """Return the mean-stress unknown of a mixed space, else None."""
        return functions[len(functions) - 1] if self.mixed else None

    @property
    def normal_indices(self) -> tuple[int, ...]:
        """Which components carry the normal displacement: one of both bodies, or that of the probe and the tissue."""
        return (2 * self.tangential,) if self.closed else (2 * self.tangential, 2 * self.tangential + 1)


def contact_pressure_kpa(mesh: Any, symmetry: Symmetry, order: int, probe_stress: Stress) -> Any:
    """Return the contact pressure on the face as a grid function (kPa, positive in compression).

    Recovered from the probe's residual, int p v dA = int sigma : e(v) dV for every v on the face, so that it balances
    the force exactly; a stress sampled at the face does not, and jumps between elements.
    """
    space = H1(mesh, order=order)  # not only over the probe: points of the face may lie in either side's elements
    v = space.TestFunction()
    residual = LinearForm(space)
    axial = symmetry.strain((*(0.0 for _ in symmetry.held), v))
    residual += work(probe_stress, axial) * symmetry.weight * symmetry.volume(LAYERS)
    residual.Assemble()
    return pressure_of_forces(space, symmetry, residual.vec)


def pressure_of_forces(space: Any, symmetry: Symmetry, forces_mn: Any) -> Any:
    """Return the pressure (kPa, grid function) whose integral against every shape function is the force on its dof."""
    p, v = space.TnT()
    mass = BilinearForm(space, symmetric=True)
    mass += p * v * symmetry.weight * symmetry.face
    mass.Assemble()
    pressure = GridFunction(space)
    on_face = space.GetDofs(space.mesh.Boundaries("face"))
    pressure.vec.data = mass.mat.Inverse(on_face, "sparsecholesky") * forces_mn
    return pressure


def integral_over_face(mesh: Any, symmetry: Symmetry, field: Expression) -> float:
    """Return the integral of a field over the modelled part of the face (field's unit times mm2)."""
    return float(Integrate(field * symmetry.weight * ds("face", bonus_intorder=HIGH_ORDERS), mesh))
