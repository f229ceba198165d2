"""One linear press: the back of the probe moves 1 mm towards the base, closed sliding contact, small strain.

Everything is linear in the press, so this one solution scales to any indentation or force.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ngsolve import BilinearForm, GridFunction, InnerProduct

from host_tools.forward.face_state import MN_PER_N, FaceState
from host_tools.forward.materials import Elasticity
from host_tools.forward.press_model import Loaded, PressFailed
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.contact import Body, ContactSpace, contact_pressure_kpa, integral_over_face
from host_tools.forward.small_strain.elasticity import Stress, lame_modulus_kpa, shear_modulus_kpa, stress, work
from host_tools.forward.small_strain.folding import Folding
from host_tools.forward.symmetry import Expression, Symmetry
from host_tools.scenes.scene import Press

INDENTATION_MM = 1.0


class LinearPress:
    """The spaces of one mesh, order and symmetry; solves for any materials."""

    def __init__(self, mesh: Any, symmetry: Symmetry, order: int, *, mixed: bool = False, closed: bool = True) -> None:
        """With `closed` False the bodies do not touch: only their stiffness can be had."""
        self.mesh, self.symmetry, self.order = mesh, symmetry, order
        self.contact = ContactSpace(mesh, symmetry, order, mixed=mixed, closed=closed)

    def displacement(self, elasticity: Elasticity, sinking_mm: Expression = INDENTATION_MM) -> Any:
        """Return the grid function that solves a(u, v) = 0 for every admissible v, the back sunk by a field (mm)."""
        space = self.contact.space
        trial, test = space.TnT()
        a = BilinearForm(space, symmetric=True, condense=True)
        for term in self.weak_form(elasticity, trial, test):
            a += term
        a.Assemble()
        u = GridFunction(space)
        back = self.mesh.Boundaries("back")
        u.components[self.contact.normal_indices[0]].Set(-sinking_mm, definedon=back)
        inverse = a.mat.Inverse(space.FreeDofs(True), "sparsecholesky")
        rest = u.vec.CreateVector()
        rest.data = -a.mat * u.vec
        rest.data += a.harmonic_extension_trans * rest
        u.vec.data += inverse * rest
        u.vec.data += a.inner_solve * rest
        u.vec.data += a.harmonic_extension * u.vec
        return u

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
            force_n=sampler.copies * self._reaction_mn(u, elasticity) / MN_PER_N,
            contact_force_n=sampler.copies * integral_over_face(self.mesh, self.symmetry, pressure) / MN_PER_N,
        )

    def stress_of_probe(self, u: Any, elasticity: Elasticity) -> Stress:
        """Return the probe's stress (kPa) under a solved displacement."""
        probe, _ = self.contact.bodies(u.components)
        return self._stress(elasticity, probe, self.contact.pressure(u.components))

    def _reaction_mn(self, u: Any, elasticity: Elasticity) -> float:
        """Return the force of the back on the modelled part: the work of the stress on a unit push of the back."""
        form = BilinearForm(self.contact.space, symmetric=True)
        for term in self.weak_form(elasticity, *self.contact.space.TnT()):
            form += term
        work_of, push = u.vec.CreateVector(), GridFunction(self.contact.space)
        form.Apply(u.vec, work_of)
        push.components[self.contact.normal_indices[0]].Set(-1.0, definedon=self.mesh.Boundaries("back"))
        return float(InnerProduct(work_of, push.vec))


class LinearModel:
    """Closed sliding in small strain as a `PressModel`: one solution, scaled to every press."""

    def __init__(
        self, mesh: Any, symmetry: Symmetry, sampler: FaceSampler, *, order: int, other_order: int, mixed: bool
    ) -> None:
        self.mesh, self.symmetry, self.sampler, self.mixed = mesh, symmetry, sampler, mixed
        self.order, self.other_order = order, other_order

    def press(self, elasticity: Elasticity, presses: Sequence[Press], *, estimate_error: bool) -> tuple[Loaded, ...]:
        """Return the face at every press, at the model's order and at the other; raise `PressFailed` where it folds."""
        linear = LinearPress(self.mesh, self.symmetry, self.order, mixed=self.mixed)
        u = linear.displacement(elasticity)
        unit = linear.face_state(u, elasticity, self.sampler)
        require_reach(presses, unit, Folding(linear.contact, u))
        other = self._unit(elasticity, self.other_order) if estimate_error else None
        return tuple(Loaded(at_press(press, unit), at_press(press, other) if other else None) for press in presses)

    def _unit(self, elasticity: Elasticity, order: int) -> FaceState:
        linear = LinearPress(self.mesh, self.symmetry, order, mixed=self.mixed)
        return linear.face_state(linear.displacement(elasticity), elasticity, self.sampler)


def at_press(press: Press, unit: FaceState) -> FaceState:
    """Return the unit press scaled to the indentation or force asked for."""
    if press.indentation_mm is not None:
        return unit.scaled(press.indentation_mm / unit.indentation_mm)
    assert press.force_n is not None  # Press guarantees one of the two
    return unit.scaled(press.force_n / unit.force_n)


def require_reach(presses: Sequence[Press], unit: FaceState, folding: Folding) -> None:
    """Refuse a press that would turn matter inside out, with the largest one that does not."""
    deepest = max((at_press(press, unit) for press in presses), key=lambda state: state.indentation_mm)
    scale = deepest.indentation_mm / unit.indentation_mm
    if deepest.indentation_mm < folding.slab_mm and not folding.folds(scale):
        return
    largest = unit.scaled(folding.largest_scale(min(scale, folding.slab_mm / unit.indentation_mm)))
    raise out_of_reach(presses, deepest, largest, folding.slab_mm)


def out_of_reach(presses: Sequence[Press], asked: FaceState, largest: FaceState, slab_mm: float) -> PressFailed:
    """Return the exception that says what was asked for, and the largest press that can be had."""
    by_force = any(press.force_n is not None for press in presses)
    quantity = f"force_n is {asked.force_n:g} N" if by_force else f"indentation_mm is {asked.indentation_mm:g} mm"
    limit = f"{largest.force_n:.3g} N" if by_force else f"{largest.indentation_mm:.3g} mm"
    return PressFailed(
        f"{quantity}, but must be below {limit}: at {largest.indentation_mm:.3g} mm of indentation and "
        f"{largest.force_n:.3g} N small strain begins to turn probe or tissue inside out in this slab "
        f"of {slab_mm:g} mm. Press less."
    )
