"""One linear press: the back of the probe moves 1 mm towards the base, closed sliding contact, small strain.

Everything is linear in the press, so this one solution scales to any indentation or force.
"""

from __future__ import annotations

from contextlib import nullcontext
from typing import Any

from ngsolve import BilinearForm, GridFunction, InnerProduct

from host_tools.forward.face_state import MN_PER_N, FaceState
from host_tools.forward.materials import Elasticity
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.contact import Body, ContactSpace, contact_pressure_kpa, integral_over_face
from host_tools.forward.small_strain.cores import factorising_in_3d
from host_tools.forward.small_strain.elasticity import Stress, lame_modulus_kpa, shear_modulus_kpa, stress, work
from host_tools.forward.symmetry import SOLID, Expression, Symmetry

INDENTATION_MM = 1.0


class LinearPress:
    """The spaces of one mesh, order and symmetry; solves for any materials."""

    def __init__(self, mesh: Any, symmetry: Symmetry, order: int, *, mixed: bool = False, closed: bool = True) -> None:
        """With `closed` False the bodies do not touch: only their stiffness can be had."""
        self.mesh, self.symmetry, self.order = mesh, symmetry, order
        self.contact = ContactSpace(mesh, symmetry, order, mixed=mixed, closed=closed)

    def displacement(self, elasticity: Elasticity, sinking_mm: Expression = INDENTATION_MM) -> Any:
        """Return the grid function that solves a(u, v) = 0 for every admissible v, the back sunk by a field (mm)."""
        return SolvedPress(self, elasticity, sinking_mm).u

    def weak_form(self, elasticity: Elasticity, trial: Any, test: Any) -> list[Any]:
        """Return the integrals of sigma(u) : e(v); in a mixed space also those that tie the pressure to tr(e)."""
        terms = []
        E, nu = elasticity.fields(self.mesh)
        p, q = self.contact.pressure(trial), self.contact.pressure(test)
        for u, v in zip(self.contact.bodies(trial), self.contact.bodies(test), strict=True):
            e = self.symmetry.strain(v.u)
            integrand = work(self._stress(elasticity, u, p), e)
            if p is not None:
                # A material without lateral contraction has lambda = 0: its pressure is as good as held at 0.
                compliance = 1 / (lame_modulus_kpa(E, nu) + 1e-9 * E)
                integrand += q * (self.symmetry.strain(u.u).trace - compliance * p)
            terms.append((integrand * self.symmetry.weight).Compile() * self.symmetry.volume(u.materials))
        return terms

    def _stress(self, elasticity: Elasticity, body: Body, pressure: Expression | None) -> Stress:
        E, nu = elasticity.fields(self.mesh)
        e = self.symmetry.strain(body.u)
        mean = lame_modulus_kpa(E, nu) * e.trace if pressure is None else pressure
        return stress(e, shear_modulus_kpa(E, nu), mean)

    def face_state(self, u: Any, elasticity: Elasticity, sampler: FaceSampler) -> FaceState:
        """Return what a solved displacement does to the face."""
        probe, _ = self.contact.bodies(u.components)
        pressure = contact_pressure_kpa(self.mesh, self.symmetry, self.order, self.stress_of_probe(u, elasticity))
        w_mm = probe.u[-1] + INDENTATION_MM
        return FaceState(
            indentation_mm=INDENTATION_MM,
            w_mm=sampler(w_mm),
            p_kpa=sampler(pressure),
            total_mm3=sampler.copies * integral_over_face(self.mesh, self.symmetry, w_mm),
            force_n=sampler.copies * self.reaction_mn(u, elasticity) / MN_PER_N,
            contact_force_n=sampler.copies * integral_over_face(self.mesh, self.symmetry, pressure) / MN_PER_N,
        )

    def stress_in(self, body: Body, elasticity: Elasticity) -> Stress:
        """Return the stress (kPa) of one body's displacements, without a pressure of their own."""
        return self._stress(elasticity, body, None)

    def stress_of_probe(self, u: Any, elasticity: Elasticity) -> Stress:
        """Return the probe's stress (kPa) under a solved displacement."""
        probe, _ = self.contact.bodies(u.components)
        return self._stress(elasticity, probe, self.contact.pressure(u.components))

    def reaction_mn(self, u: Any, elasticity: Elasticity) -> float:
        """Return the force of the back on the modelled part: the work of the stress on a unit push of the back."""
        form = BilinearForm(self.contact.space, symmetric=True)
        for term in self.weak_form(elasticity, *self.contact.space.TnT()):
            form += term
        work_of, push = u.vec.CreateVector(), GridFunction(self.contact.space)
        form.Apply(u.vec, work_of)
        push.components[self.contact.normal_indices[0]].Set(-1.0, definedon=self.mesh.Boundaries("back"))
        return float(InnerProduct(work_of, push.vec))


class SolvedPress:
    """A press, its materials and the factor of their stiffness, which further loads can be solved with."""

    def __init__(self, press: LinearPress, elasticity: Elasticity, sinking_mm: Expression = INDENTATION_MM) -> None:
        self.press, self.elasticity = press, elasticity
        space = press.contact.space
        trial, test = space.TnT()
        self._form = BilinearForm(space, symmetric=True, condense=True)
        for term in press.weak_form(elasticity, trial, test):
            self._form += term
        with factorising_in_3d() if press.symmetry is SOLID else nullcontext():
            self._form.Assemble()
            self._inverse = self._form.mat.Inverse(space.FreeDofs(True), "sparsecholesky")
        self.u = GridFunction(space)
        back = press.mesh.Boundaries("back")
        self.u.components[press.contact.normal_indices[0]].Set(-sinking_mm, definedon=back)
        rest = self.u.vec.CreateVector()
        rest.data = -self._form.mat * self.u.vec
        self._answer(rest, self.u.vec)

    def under(self, load: Any) -> Any:
        """Return the grid function that answers a load (a vector, mN) while back and base stand still."""
        z = GridFunction(self.press.contact.space)
        rest = load.CreateVector()
        rest.data = load
        self._answer(rest, z.vec)
        return z

    def _answer(self, rest: Any, u: Any) -> None:
        """Add to a vector what condensed unknowns and inner ones answer to a residual, which is used up."""
        rest.data += self._form.harmonic_extension_trans * rest
        u.data += self._inverse * rest
        u.data += self._form.inner_solve * rest
        u.data += self._form.harmonic_extension * u
