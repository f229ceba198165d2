"""Frictionless contact of paired material points: the cheap stand-in for sliding in finite strain.

Each point of the probe's face shares its axial displacement with the tissue point it first touched, wherever that has
slid to. Right to first order in the load; of the reference inclusion field it makes 8 % too much at 1 mm, 16 % at 2 mm.
"""

from __future__ import annotations

from typing import Any

from ngsolve import H1, BilinearForm, GridFunction, Variation

from host_tools.forward.finite_strain.closed_contact import RADIAL, push_of_back
from host_tools.forward.finite_strain.hyperelasticity import NeoHookean, deformation_gradient
from host_tools.forward.materials import FLESH, LAYERS, Elasticity
from host_tools.forward.symmetry import AXISYMMETRIC, Expression

FLESH_RADIAL = 2
"""Component of the tissue's own u_r."""


class PairedContact:
    """Closed contact with separate u_r of probe and tissue and one u_z; see `ClosedContact`."""

    def __init__(self, mesh: Any, elasticity: Elasticity, order: int) -> None:
        self.mesh, self.elasticity, self.order = mesh, elasticity, order
        probe_r = H1(mesh, order=order, definedon=mesh.Materials(LAYERS), dirichlet="axis|back")
        flesh_r = H1(mesh, order=order, definedon=mesh.Materials(FLESH), dirichlet="axis|base")
        self.space = probe_r * H1(mesh, order=order, dirichlet="back|base") * flesh_r
        self.u, self.free = GridFunction(self.space), self.space.FreeDofs()
        self.push = push_of_back(self.space)
        u_r, u_z, tissue_r = self.space.TrialFunction()
        law = NeoHookean.of(elasticity, mesh)

        def term(radial: Expression, materials: str) -> Any:
            density = law.energy_density_kpa(deformation_gradient(radial, u_z)) * AXISYMMETRIC.weight
            return Variation(density.Compile() * AXISYMMETRIC.volume(materials))

        self.probe_energy = BilinearForm(self.space, symmetric=True)
        self.probe_energy += term(u_r, LAYERS)
        self.energy = BilinearForm(self.space, symmetric=True)
        self.energy += term(u_r, LAYERS)
        self.energy += term(tissue_r, FLESH)

    @property
    def memory(self) -> tuple[Any, ...]:
        """The vectors that make up the state."""
        return (self.u.vec,)

    def relabel(self) -> bool:
        """Do nothing: the labels never move."""
        return True

    def slip_mm(self) -> Any:
        """Return u_r of the probe minus that of the tissue; negative where the tissue has slid outwards."""
        # Over both bodies: the point finder may see a point of the face in either's elements.
        on_face = GridFunction(H1(self.mesh, order=self.order))
        slip = self.u.components[RADIAL] - self.u.components[FLESH_RADIAL]
        on_face.Set(slip, definedon=self.mesh.Boundaries("face"))
        return on_face

    def at_order(self, order: int) -> PairedContact:
        """Return the same contact, undeformed, in spaces of another order."""
        return PairedContact(self.mesh, self.elasticity, order)

    def copy_from(self, other: PairedContact) -> None:
        """Take over the state of a contact of the same or a lower order, exactly."""
        for mine, theirs in zip(self.u.components, other.u.components, strict=True):
            mine.Set(theirs)
