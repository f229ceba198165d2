"""A domed face in small strain: unilateral contact, closed where it is pressed and open where it is not.

Both bodies are linear, so all that the contact needs of them is their compliance between the dofs of the face: one
factorisation, and then every press is a small dense problem. Where the approach minus the initial gap is positive a
stiff penalty pushes back (its own compliance moves forces by 1e-5). The dome enters as the gap only: the first layer's
thickness stays as if it were flat. Source: Johnson, Contact Mechanics (1985), section 5.9; the test is Hertz.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from ngsolve import H1, BilinearForm, GridFunction, IfPos, x, y
from scipy.optimize import root_scalar
from scipy.sparse import csr_matrix

from device.measurement.arrays import Array
from host_tools.forward.face_state import MN_PER_N, FaceState
from host_tools.forward.materials import Elasticity
from host_tools.forward.press_model import Loaded, PressFailed
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.contact import integral_over_face, pressure_of_forces
from host_tools.forward.small_strain.folding import Folding
from host_tools.forward.small_strain.linear_model import out_of_reach
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import AXISYMMETRIC, Symmetry
from host_tools.scenes.scene import Press

PENALTY_PER_MM = 2e4
"""Penalty stiffness over the tissue's modulus: kPa per mm for each kPa."""
NEWTON_STEPS = 60
TOLERANCE_RATIO = 1e-10
"""Newton has settled when its step, over the approach, is below this."""
BISECTIONS = 12
"""Contacts solved to find the largest press that can be had, to 1/4096 of the one asked for."""
SLOPE_RATIO = 1e-3
"""A full step may leave the energy rising by so much of how steeply it fell: near the minimum that is rounding."""


class DomedModel:
    """Unilateral contact under a paraboloid as a `PressModel`."""

    def __init__(
        self,
        mesh: Any,
        symmetry: Symmetry,
        sampler: FaceSampler,
        *,
        order: int,
        other_order: int,
        mixed: bool,
        curvature_per_mm: float,
    ) -> None:
        """`curvature_per_mm` is the dome's height over the square of the radius it falls off to."""
        self.mesh, self.symmetry, self.sampler, self.mixed = mesh, symmetry, sampler, mixed
        self.order, self.other_order = order, other_order
        self.gap_mm = curvature_per_mm * (x * x if symmetry is AXISYMMETRIC else x * x + y * y)

    def press(self, elasticity: Elasticity, presses: Sequence[Press], *, estimate_error: bool) -> tuple[Loaded, ...]:
        """Return the face at every press; raise `PressFailed` when Newton does not settle."""
        orders = (self.order, self.other_order) if estimate_error else (self.order,)
        states = [_Contact(self, elasticity, order).at_all(presses) for order in orders]
        others = states[1] if estimate_error else [None] * len(presses)
        return tuple(Loaded(state, other) for state, other in zip(states[0], others, strict=True))


class _Contact:
    """One material and order: compliances between the n dofs of the face, in mm per mN, and the contact on them."""

    def __init__(self, model: DomedModel, elasticity: Elasticity, order: int) -> None:
        self.model = model
        self.face_space = H1(model.mesh, order=order)
        self.dofs = self._dofs(self.face_space)
        self.probe, self.flesh = self._compliances(elasticity, order)
        self.elastic = np.linalg.inv(self.probe + self.flesh)
        self.one, self.gap = self._on_face(1.0), self._on_face(model.gap_mm)
        self.depth = GridFunction(self.face_space)
        penalty = PENALTY_PER_MM * elasticity.modulus_kpa["tissue0"]
        trial, test = self.face_space.TnT()
        self.form = BilinearForm(self.face_space, check_unused=False)
        self.form += IfPos(trial, penalty * trial, 0.0) * test * model.symmetry.weight * model.symmetry.face

    def _compliances(self, elasticity: Elasticity, order: int) -> tuple[Array, Array]:
        """Return the normal displacement of probe and tissue at every dof for a unit force at every other."""
        linear = LinearPress(self.model.mesh, self.model.symmetry, order, mixed=self.model.mixed, closed=False)
        space = linear.contact.space
        form = BilinearForm(space, symmetric=True)
        for term in linear.weak_form(elasticity, *space.TnT()):
            form += term
        form.Assemble()
        inverse = form.mat.Inverse(space.FreeDofs(), "sparsecholesky")
        push, u = form.mat.CreateColVector(), form.mat.CreateRowVector()
        self.linear, self.inverse, self.pushed_dofs = linear, inverse, []
        found = []
        for component in linear.contact.normal_indices:
            # numbered otherwise than in the face's own space, but in the same order
            dofs = space.Range(component).start + self._dofs(space.components[component])
            self.pushed_dofs.append(dofs)
            columns = []
            for dof in dofs:
                push[:] = 0.0
                push[int(dof)] = 1.0
                u.data = inverse * push
                columns.append(u.FV().NumPy()[dofs].copy())
            found.append(np.array(columns).T)
        return found[0], found[1]

    def _dofs(self, space: Any) -> Any:
        return np.flatnonzero(list(space.GetDofs(self.model.mesh.Boundaries("face"))))

    def _on_face(self, field: Any) -> Array:
        function = GridFunction(self.face_space)
        function.Set(field, definedon=self.model.mesh.Boundaries("face"))
        return np.asarray(function.vec.FV().NumPy()[self.dofs])

    def at_all(self, presses: Sequence[Press]) -> list[FaceState]:
        """Return the face at every press; raise `PressFailed` for one that folds a body or touches too few elements."""
        depths_mm = [self._indentation_mm(press) for press in presses]
        if self._folds(max(depths_mm)):
            slab_mm = self._folding(0.0).slab_mm
            low_mm, high_mm = 0.0, min(max(depths_mm), slab_mm)
            for _ in range(BISECTIONS):
                middle_mm = (low_mm + high_mm) / 2
                low_mm, high_mm = (low_mm, middle_mm) if self._folds(middle_mm) else (middle_mm, high_mm)
            raise out_of_reach(presses, self._face_state(max(depths_mm)), self._face_state(low_mm), slab_mm)
        return [self._face_state(indentation_mm) for indentation_mm in depths_mm]

    def _folds(self, indentation_mm: float) -> bool:
        folding = self._folding(indentation_mm)
        return indentation_mm >= folding.slab_mm or folding.folds()

    def _folding(self, indentation_mm: float) -> Folding:
        """Return both bodies under the forces of the contact at an indentation."""
        forces = self._forces(indentation_mm) if indentation_mm > 0 else 0 * self.gap
        u = GridFunction(self.linear.contact.space)
        push = u.vec.CreateVector()
        push[:] = 0.0
        for dofs, sign in zip(self.pushed_dofs, (1.0, -1.0), strict=True):
            push.FV().NumPy()[dofs] = sign * forces
        u.vec.data = self.inverse * push
        return Folding(self.linear.contact, u)

    def _indentation_mm(self, press: Press) -> float:
        if press.indentation_mm is not None:
            return press.indentation_mm
        target_n = press.force_n
        assert target_n is not None  # Press guarantees one of the two
        flat_mm = target_n * MN_PER_N / float(self.one @ self.elastic @ self.one)
        most_mm = flat_mm + float(self.gap.max()) + 1.0
        bracket = (0.0, most_mm)
        found = root_scalar(lambda mm: self._force_n(mm) - target_n, bracket=bracket, xtol=1e-12, rtol=1e-12)
        return float(found.root)

    def _force_n(self, indentation_mm: float) -> float:
        sector_n = float(self.one @ self._forces(indentation_mm)) / MN_PER_N if indentation_mm > 0 else 0.0
        return self.model.sampler.copies * sector_n

    def _forces(self, indentation_mm: float) -> Array:
        """Return the contact force on every dof (mN) by minimising a convex energy, elastic plus penalty.

        Newton steps cycle when samples open and close in turn, so each is shortened to where the energy stops falling.
        """
        approach = indentation_mm * self.one - self.gap
        depth = approach.copy()
        for _ in range(NEWTON_STEPS):
            slope, stiffness = self._slope(depth, approach), self._penalty_stiffness(depth)
            step = np.asarray(np.linalg.solve(self.elastic + stiffness, -slope))
            step *= self._share(depth, step, approach)
            depth += step
            if np.abs(step).max() < TOLERANCE_RATIO * indentation_mm:
                return self._push_back(depth)
        raise PressFailed(f"the contact under the dome did not settle at {indentation_mm:g} mm: press less deep")

    def _slope(self, depth: Array, approach: Array) -> Array:
        """Return the derivative of the energy by the depth of every dof."""
        return np.asarray(self._push_back(depth) - self.elastic @ (approach - depth))

    def _share(self, depth: Array, step: Array, approach: Array) -> float:
        """Return how much of a step to take: all of it, or up to where the energy has its least value along it."""

        def slope_along(share: float) -> float:
            return float(self._slope(depth + share * step, approach) @ step)

        if slope_along(1.0) <= SLOPE_RATIO * abs(slope_along(0.0)):
            return 1.0
        return float(root_scalar(slope_along, bracket=(0.0, 1.0), xtol=1e-3).root)

    def _push_back(self, depth: Array) -> Array:
        """Return the penalty's force on every dof (mN)."""
        self.depth.vec.FV().NumPy()[self.dofs] = depth
        forces = self.depth.vec.CreateVector()
        self.form.Apply(self.depth.vec, forces)
        return np.array(forces.FV().NumPy()[self.dofs])

    def _penalty_stiffness(self, depth: Array) -> Array:
        """Return the derivative of the penalty's forces (mN per mm)."""
        self.depth.vec.FV().NumPy()[self.dofs] = depth
        self.form.AssembleLinearization(self.depth.vec)
        return _dense(self.form.mat.CSR(), self.dofs)

    def _face_state(self, indentation_mm: float) -> FaceState:
        model, forces = self.model, self._forces(indentation_mm)
        w_mm, on_dofs = GridFunction(self.face_space), GridFunction(self.face_space)
        w_mm.vec.FV().NumPy()[self.dofs] = self.probe @ forces
        on_dofs.vec.FV().NumPy()[self.dofs] = forces
        pressure = pressure_of_forces(self.face_space, model.symmetry, on_dofs.vec)
        return FaceState(
            indentation_mm=indentation_mm,
            w_mm=model.sampler(w_mm),
            p_kpa=model.sampler(pressure),
            total_mm3=model.sampler.copies * integral_over_face(model.mesh, model.symmetry, w_mm),
            force_n=model.sampler.copies * float(self.one @ forces) / MN_PER_N,
            contact_force_n=model.sampler.copies * integral_over_face(model.mesh, model.symmetry, pressure) / MN_PER_N,
        )


def _dense(compressed_rows: Any, dofs: Any) -> Array:
    """Return the block of some dofs of a sparse matrix."""
    values, columns, starts = (np.asarray(part) for part in compressed_rows)
    return np.asarray(csr_matrix((values, columns, starts))[np.ix_(dofs, dofs)].toarray())
