"""Two orders of one press to what each element owes to a quantity of the face: its dual-weighted residual.

With e the step of the displacement from one order to the next and z the displacement that answers the quantity's own
load, the quantity's step is a(e, z): exactly, and for z short of what the lower order has of it, too. So its parts
a_K(e, z) over the elements K add up to the step, and their absolute values to what the step would be if no element's
error cancelled another's. Source: Becker & Rannacher, Acta Numerica 10, 2001, section 3.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from ngsolve import GridFunction, Integrate, LinearForm
from numpy.typing import NDArray

from device.measurement.arrays import Array
from host_tools.forward.face_state import MN_PER_N
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.elasticity import work
from host_tools.forward.small_strain.linear_press import SolvedPress

NEAR_MM = 2.0
"""From a rim to the middles of the elements that count as near it."""


class ElementResidual:
    """The step from one order to the next of one unit press, element by element. In axisymmetry, with displacements."""

    def __init__(self, low: SolvedPress, high: SolvedPress, sampler: FaceSampler) -> None:
        self._low, self._high, self._sampler = low, high, sampler
        self._step = GridFunction(high.press.contact.space)
        self._step.vec.data = high.u.vec - self._raised(low.u).vec
        self.force_n = self._work(self._step) / MN_PER_N
        """By how much each element makes the lower order too stiff [elements], in N for 1 mm."""

    @cached_property
    def is_near_rim(self) -> NDArray[np.bool_]:
        """Whether each element [elements] lies near the rim of the face or of the back, where stress is singular."""
        mesh = self._high.press.mesh
        middles = np.array([np.mean([mesh[v].point for v in one.vertices], axis=0) for one in mesh.Elements()])
        far_mm = np.min([np.hypot(*(middles - rim).T) for rim in _rims(mesh)], axis=0)
        return np.asarray(far_mm < NEAR_MM)

    def of(self, per_sample: Array, per_total: float) -> Array:
        """Return each element's part [elements] of the step of a sum over the face, for 1 mm of indentation.

        The sum is of the deformation at the samples [R], times `per_sample`, and of its integral, times `per_total`.
        """
        dual = self._high.under(self._load(self._high, per_sample, per_total))
        dual.vec.data -= self._raised(self._low.under(self._load(self._low, per_sample, per_total))).vec
        return self._work(dual)

    def _raised(self, low: Any) -> Any:
        """Return a function of the lower order in the space of the higher, the same to rounding."""
        raised = GridFunction(self._high.press.contact.space)
        for above, below in zip(raised.components, low.components, strict=True):
            above.Set(below)
        return raised

    def _work(self, v: Any) -> Array:
        """Return the work of the step's stress on another displacement's strain, element by element (uJ)."""
        press = self._high.press
        found = np.zeros(press.mesh.ne)
        bodies = zip(press.contact.bodies(self._step.components), press.contact.bodies(v.components), strict=True)
        for of_step, of_v in bodies:
            stress = press.stress_in(of_step, self._high.elasticity)
            density = work(stress, press.symmetry.strain(of_v.u)) * press.symmetry.weight
            region = press.mesh.Materials(of_step.materials)
            order = 2 * press.order + 2
            found += np.array(Integrate(density, press.mesh, element_wise=True, definedon=region, order=order))
        return found

    def _load(self, solved: SolvedPress, per_sample: Array, per_total: float) -> Any:
        """Return the vector of a sum over the face: its value for every shape function."""
        contact = solved.press.contact
        form = LinearForm(contact.space)
        axial = contact.space.TestFunction()[contact.normal_indices[0]]
        form += per_total * axial * contact.symmetry.weight * contact.symmetry.face
        form.Assemble()
        shape = GridFunction(contact.space)
        samples = per_sample.nonzero()[0]
        if len(samples):
            normal = shape.components[contact.normal_indices[0]]
            start = contact.space.Range(contact.normal_indices[0]).start
            for dof in self._face_dofs(solved):
                normal.vec[:] = 0.0
                normal.vec[dof] = 1.0
                form.vec[start + dof] += float(per_sample @ self._sampler(normal)[0])
        return form.vec

    @staticmethod
    def _face_dofs(solved: SolvedPress) -> list[int]:
        contact = solved.press.contact
        normal = contact.space.components[contact.normal_indices[0]]
        return [int(dof) for dof in np.flatnonzero(list(normal.GetDofs(contact.mesh.Boundaries("face"))))]


def _rims(mesh: Any) -> list[tuple[float, float]]:
    """Return the outer ends of the face and of the back in the half plane (mm)."""
    return [
        max(mesh[v].point for edge in mesh.Boundaries(name).Elements() for v in edge.vertices)
        for name in ("face", "back")
    ]
