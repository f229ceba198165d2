"""A press in equilibrium and its tangent: what derivatives are made from, alike in small and in finite strain.

The forces are linear in every modulus, so the part of them that one material makes is their derivative by the
logarithm of its modulus, exactly.
"""

from __future__ import annotations

from typing import Any, Protocol

from ngsolve import BilinearForm, GridFunction

from host_tools.forward.derivatives.form_action import StateVector, applied, product
from host_tools.forward.derivatives.sliding_parts import SlidingParts
from host_tools.forward.face_state import FaceState
from host_tools.forward.finite_strain.closed_contact import AXIAL
from host_tools.forward.finite_strain.loaded_face import face_state
from host_tools.forward.finite_strain.newton import EnergyNewton
from host_tools.forward.finite_strain.sliding import SlidingContact
from host_tools.forward.materials import Elasticity, Parts, only
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import AXISYMMETRIC, Symmetry


class Equilibrium(Protocol):
    """A press in equilibrium at one load; forces are in mN, and vanish but at held unknowns."""

    mesh: Any
    symmetry: Symmetry
    sampler: FaceSampler
    order: int
    face: FaceState
    axial: int
    """Component of the unknowns that moves both bodies along z."""
    space: Any
    push: StateVector
    """How the held unknowns move for each mm of indentation."""
    moduli: tuple[str, ...]

    def forces(self) -> StateVector:
        """Return the forces of both bodies on the mesh as it stands now."""

    def forces_by(self, modulus: str) -> StateVector:
        """Return the derivative of the forces by the logarithm of a modulus."""

    def held_by(self, quantity: str) -> StateVector:
        """Return how the held unknowns move by the logarithm of a quantity at the same indentation."""

    def tangent(self, motion: StateVector) -> StateVector:
        """Return the change of the forces by a motion of the unknowns."""

    def probe_tangent(self, motion: StateVector) -> StateVector:
        """Return the change of the probe's own forces by a motion of the unknowns."""

    def solve(self, forces: StateVector) -> StateVector:
        """Return the motion of the free unknowns by which the tangent answers forces on them."""


class LinearEquilibrium:
    """The unit press in small strain."""

    def __init__(self, linear: LinearPress, elasticity: Elasticity, parts: Parts, sampler: FaceSampler) -> None:
        self._linear, self.sampler = linear, sampler
        self.mesh, self.symmetry, self.order = linear.mesh, linear.symmetry, linear.order
        self.space, self.axial, self.moduli = linear.contact.space, linear.contact.normal_indices[0], tuple(parts)
        self.u = linear.displacement(elasticity)
        self.face = linear.face_state(self.u, elasticity, sampler)
        push = GridFunction(self.space)
        push.components[self.axial].Set(-1.0, definedon=self.mesh.Boundaries("back"))
        self.push = push.vec
        self._condensed = self._form(elasticity, condense=True)
        self._condensed.Assemble()
        self._inverse = self._condensed.mat.Inverse(self.space.FreeDofs(True), "sparsecholesky")
        self._all = self._form(elasticity)
        self._probe = self._form(only(elasticity, "layer"))
        self._parts = {name: self._form(part) for name, part in parts.items()}

    def _form(self, elasticity: Elasticity, *, condense: bool = False) -> Any:
        form = BilinearForm(self.space, symmetric=True, condense=condense)
        for term in self._linear.weak_form(elasticity, *self.space.TnT()):
            form += term
        return form

    def forces(self) -> StateVector:
        """See `Equilibrium`."""
        return applied(self._all, self.u.vec)

    def forces_by(self, modulus: str) -> StateVector:
        """See `Equilibrium`."""
        return applied(self._parts[modulus], self.u.vec)

    def held_by(self, quantity: str) -> StateVector:
        """See `Equilibrium`: nothing moves."""
        return GridFunction(self.space).vec

    def tangent(self, motion: StateVector) -> StateVector:
        """See `Equilibrium`."""
        return applied(self._all, motion)

    def probe_tangent(self, motion: StateVector) -> StateVector:
        """See `Equilibrium`."""
        return applied(self._probe, motion)

    def solve(self, forces: StateVector) -> StateVector:
        """See `Equilibrium`."""
        form, rest, answer = self._condensed, forces.CreateVector(), forces.CreateVector()
        rest.data = forces
        rest.data += form.harmonic_extension_trans * rest
        answer.data = self._inverse * rest
        answer.data += form.harmonic_extension * answer
        answer.data += form.inner_solve * rest
        return answer


class SlidingEquilibrium:
    """A sliding contact in equilibrium in finite strain; good until it is moved on."""

    def __init__(
        self,
        contact: SlidingContact,
        newton: EnergyNewton,
        indentation_mm: float,
        parts: SlidingParts,
        sampler: FaceSampler,
    ) -> None:
        self.mesh, self.symmetry, self.sampler, self.order = contact.mesh, AXISYMMETRIC, sampler, contact.order
        self.space, self.axial, self.moduli = contact.space, AXIAL, tuple(parts.by_modulus)
        self.u, self.push = contact.u, contact.push.vec
        self.face = face_state(contact, indentation_mm, sampler)
        self._contact, self._newton, self._parts = contact, newton, parts
        newton.assemble()
        contact.probe_energy.AssembleLinearization(self.u.vec)

    def forces(self) -> StateVector:
        """See `Equilibrium`."""
        return applied(self._contact.energy, self.u.vec)

    def forces_by(self, modulus: str) -> StateVector:
        """See `Equilibrium`."""
        return self._parts.forces_by(modulus, self.u.vec, self._contact.memory[1])

    def held_by(self, quantity: str) -> StateVector:
        """See `Equilibrium`: the rim slips in proportion to the indentation."""
        slip = GridFunction(self.space)
        slip.vec[self._parts.rim] = self.face.indentation_mm * self._parts.rim_rates[quantity]
        return slip.vec

    def tangent(self, motion: StateVector) -> StateVector:
        """See `Equilibrium`."""
        return product(self._newton.energy.mat, motion)

    def probe_tangent(self, motion: StateVector) -> StateVector:
        """See `Equilibrium`."""
        return product(self._contact.probe_energy.mat, motion)

    def solve(self, forces: StateVector) -> StateVector:
        """See `Equilibrium`."""
        return self._newton.direction(forces)
