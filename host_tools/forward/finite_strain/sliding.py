"""Frictionless sliding in finite strain as a relabelling of the tissue (an arbitrary Lagrangian-Eulerian view).

The mesh point (r, z) of the tissue is the material point (r + m, z), and moves to (r + u_r, z + u_z): so
F = grad y (grad X)^-1, and energies are taken per mesh volume times det grad X. Stationary in u this is equilibrium;
stationary in m on the face it is zero traction along the *deformed* face. Only m on the face is unknown: inside the
tissue any labels will do, and they are spread harmonically so that no element folds.
The rim needs a choice. Stationary in its slip, too, the sharp edge drives out what slides around it (Bigoni et al.,
Mechanics of Materials 80, 2015, on Eshelby-like forces): consistent in energy, but that slip grows without bound as
the mesh is refined, and a contact of faces has no such force. So by default the rim slips at its rate in small strain,
which is what a contact search on faces finds (docs/verification.md); `edge_force` gives the other reading.
Source: Donea et al., Arbitrary Lagrangian-Eulerian methods, Encyclopedia of Computational Mechanics (2004), sec. 3.

The shift of the labels on the face is carried into the whole tissue harmonically, so smoothly and without overshoot. It
vanishes on the axis, base, side and in the inclusion, and is free on the skin. Only radii are relabelled, so planes
between tissue layers stay where they are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from ngsolve import (
    CF,
    H1,
    BilinearForm,
    BitArray,
    GridFunction,
    IfPos,
    Integrate,
    Projector,
    SymbolicEnergy,
    dx,
    grad,
    x,
)

from host_tools.forward.finite_strain.body_energy import BodyEnergy
from host_tools.forward.finite_strain.closed_contact import AXIAL, RADIAL, push_of_back
from host_tools.forward.finite_strain.hyperelasticity import DeformationGradient, NeoHookean, deformation_gradient
from host_tools.forward.materials import FLESH, INCLUSION, LAYERS, Elasticity
from host_tools.forward.symmetry import AXISYMMETRIC, Expression


class LabelSpread:
    """Harmonic extension, in a space of shifts over the tissue, of the values on its face."""

    def __init__(self, labels: Any) -> None:
        self.labels, mesh = labels, labels.mesh
        self.flesh = dx(FLESH, bonus_intorder=AXISYMMETRIC.bonus_order)
        kept = labels.GetDofs(mesh.Boundaries("face|base|side")) | labels.GetDofs(mesh.Materials(INCLUSION))
        self.inner = labels.FreeDofs() & ~kept
        self.on_face = Projector(labels.GetDofs(mesh.Boundaries("face")) & labels.FreeDofs(), True)
        m, n = labels.TnT()
        self.laplacian = BilinearForm(labels, symmetric=True)
        self.laplacian += (grad(m) * grad(n) + m * n / x**2) * x * self.flesh  # of the vector field m e_r
        self.laplacian.Assemble()
        self.inverse = self.laplacian.mat.Inverse(self.inner, "sparsecholesky")

    def __call__(self, shift: Any) -> Any:
        """Return the vector (mm) that agrees with a given one on the face and is harmonic elsewhere."""
        spread, rest = shift.CreateVector(), shift.CreateVector()
        spread.data = shift
        self.on_face.Project(spread)
        rest.data = self.laplacian.mat * spread
        spread.data -= self.inverse * rest
        return spread

    def in_order(self, shift: Any) -> bool:
        """Return whether no label overtakes its neighbour: 1 + dm/dr > 0 and 1 + m/r > 0 at every quadrature point."""
        smallest = IfPos(1 + grad(shift)[0], 0, 1) + IfPos(1 + shift / x, 0, 1)
        return float(Integrate(smallest * self.flesh, self.labels.mesh)) == 0.0


SLIP = 2
"""Component of m, the shift of the tissue's labels since they were last spread."""


def relabelled(F: DeformationGradient, m: Expression, m_gradient: Expression) -> tuple[DeformationGradient, Expression]:
    """Return the gradient with respect to the material points X = r + m, and det grad X."""
    X_r, X_z, hoop = 1 + m_gradient[0], m_gradient[1], 1 + m / x
    inverse = CF((1 / X_r, -X_z / X_r, 0, 1), dims=(2, 2))
    return DeformationGradient(F.in_plane * inverse, F.hoop / hoop), X_r * hoop


class SlidingContact:
    """Closed contact in which the tissue slides along the deformed face; see `ClosedContact`."""

    def __init__(self, mesh: Any, elasticity: Elasticity, order: int, *, edge_force: bool = False) -> None:
        """With `edge_force` the slip of the rim is an unknown too; without, it grows at its rate in small strain."""
        self.mesh, self.elasticity, self.order, self.edge_force = mesh, elasticity, order, edge_force
        flesh = mesh.Materials(FLESH)
        u_r = H1(mesh, order=order, dirichlet="axis|back|base")
        u_z = H1(mesh, order=order, dirichlet="back|base")
        self.labels = H1(mesh, order=order, definedon=flesh, dirichlet="axis")
        self.space = u_r * u_z * self.labels
        self.u, self.spread = GridFunction(self.space), GridFunction(self.labels)
        self.free = self._free_dofs()
        self.energy, self.probe_energy, self.fast_energy = self._energies(NeoHookean.of(elasticity, mesh))
        self.harmonic = LabelSpread(self.labels)
        inner_flesh = u_r.GetDofs(flesh) & ~u_r.GetDofs(mesh.Materials(LAYERS))
        self.push = push_of_back(self.space)
        self._rim: tuple[int, int] | None = None
        if not edge_force:
            self._hold_rim()
        self.inner = {i: Projector(s.FreeDofs() & inner_flesh, True) for i, s in ((RADIAL, u_r), (AXIAL, u_z))}

    def _free_dofs(self) -> Any:
        free = BitArray(self.space.FreeDofs())
        on_face, first = self.labels.GetDofs(self.mesh.Boundaries("face")), self.space.Range(SLIP).start
        for dof in range(self.labels.ndof):
            if not on_face[dof]:
                free.Clear(first + dof)
        return free

    def _hold_rim(self) -> None:
        """Take the slip of the rim out of the unknowns, and let it grow at its rate in small strain."""
        self.energy.AssembleLinearization(self.u.vec)
        rate, force = self.u.vec.CreateVector(), self.u.vec.CreateVector()
        force.data = self.energy.mat * self.push.vec
        rate.data = self.push.vec - self.energy.mat.Inverse(self.free, "sparsecholesky") * force
        face = {vertex for element in self.mesh.Boundaries("face").Elements() for vertex in element.vertices}
        rim = max(face, key=lambda vertex: self.mesh[vertex].point[0])
        label = self.labels.GetDofNrs(rim)[0]
        dof = self.space.Range(SLIP).start + label
        self._rim = dof, label
        self.push.vec[dof] = rate[dof]
        self.free.Clear(dof)

    def _energies(self, law: NeoHookean) -> tuple[Any, Any, BodyEnergy]:
        u_r, u_z, m = self.space.TrialFunction()
        F = deformation_gradient(u_r, u_z)

        def term(density: Expression, elements: Any) -> Any:
            integrand = (density * AXISYMMETRIC.weight).Compile()
            return SymbolicEnergy(integrand, definedonelements=elements, bonus_intorder=AXISYMMETRIC.bonus_order)

        def tissue(shift: Expression, shift_gradient: Expression) -> Expression:
            F_tissue, volume_ratio = relabelled(F, shift, shift_gradient)
            return law.energy_density_kpa(F_tissue) * volume_ratio

        probe, at_face, beyond = self._regions()
        probe_energy = BilinearForm(self.space, symmetric=True)
        probe_energy += term(law.energy_density_kpa(F), probe)
        energy = BilinearForm(self.space, symmetric=True)
        energy += term(law.energy_density_kpa(F), probe)
        energy += term(tissue(m + self.spread, grad(m) + grad(self.spread)), at_face)
        energy += term(tissue(self.spread, grad(self.spread)), beyond)  # m vanishes there: half the work
        face_energy = BilinearForm(self.space, symmetric=True)
        face_energy += term(tissue(m + self.spread, grad(m) + grad(self.spread)), at_face)
        others = np.flatnonzero(list(probe | beyond))
        return energy, probe_energy, BodyEnergy(energy, face_energy, others, law, self.spread)

    def _regions(self) -> tuple[Any, Any, Any]:
        """Return bit arrays of elements: the probe's, the tissue's that touch the face, the tissue's that do not."""
        mesh = self.mesh
        face = {vertex.nr for element in mesh.Boundaries("face").Elements() for vertex in element.vertices}
        probe, at_face, beyond = (BitArray(mesh.ne) for _ in range(3))
        for region in (probe, at_face, beyond):
            region.Clear()
        for element in mesh.Materials(LAYERS).Elements():
            probe.Set(element.nr)
        for element in mesh.Materials(FLESH).Elements():
            touches = any(vertex.nr in face for vertex in element.vertices)
            (at_face if touches else beyond).Set(element.nr)
        return probe, at_face, beyond

    @property
    def memory(self) -> tuple[Any, ...]:
        """The vectors that make up the state."""
        return self.u.vec, self.spread.vec

    def hold(self, indentation_mm: float) -> None:
        """Give the rim the slip that it has in these materials at an indentation."""
        if self._rim is not None:
            held, label = self._rim
            self.u.vec[held] = indentation_mm * self.push.vec[held] - self.spread.vec[label]

    def relabel(self) -> bool:
        """Spread the slip of the face into the tissue, and move the displacement along: y += grad y (grad X)^-1 dX.

        The move is exact to first order in the change of labels, which is what equilibrium then has to repair.
        """
        m, old, change = self.u.components[SLIP], GridFunction(self.labels), GridFunction(self.labels)
        old.vec.data = self.spread.vec + m.vec
        self.spread.vec.data = self.harmonic(old.vec)
        change.vec.data = self.spread.vec - old.vec
        m.vec[:] = 0
        shift = change / (1 + grad(old)[0])
        for component, identity in ((RADIAL, 1), (AXIAL, 0)):
            u = self.u.components[component]
            move = GridFunction(u.space)
            move.Set((identity + grad(u)[0]) * shift, definedon=self.mesh.Materials(FLESH))
            self.inner[component].Project(move.vec)
            u.vec.data += move.vec
        return self.harmonic.in_order(self.spread)

    def slip_mm(self) -> Any:
        """Return m on the face; negative where the tissue has slid outwards."""
        # Over both bodies: the point finder may see a point of the face in either's elements.
        on_face = GridFunction(H1(self.mesh, order=self.order))
        on_face.Set(self.spread + self.u.components[SLIP], definedon=self.mesh.Boundaries("face"))
        return on_face

    def at_order(self, order: int) -> SlidingContact:
        """Return the same contact, undeformed, in spaces of another order."""
        return SlidingContact(self.mesh, self.elasticity, order, edge_force=self.edge_force)

    def copy_from(self, other: SlidingContact) -> None:
        """Take over the state of a contact of the same or a lower order, exactly."""
        for mine, theirs in zip(self.u.components, other.u.components, strict=True):
            mine.Set(theirs)
        self.spread.Set(other.spread)
