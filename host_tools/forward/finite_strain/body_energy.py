"""The stored energy away from the face, all elements at once in NumPy, beside NGSolve's of the elements at the face.

NGSolve differentiates an energy automatically, by a pass through the whole law for each pair of unknowns. Where labels
are fixed the law is neo-Hookean in five numbers, q = (F_rr, F_rz, F_zr, F_zz, hoop), with short derivatives: with
J = det F, c = dJ/dq and I1 = q.q, dW/dq = mu J^-2/3 (q - I1 c / (3 J)) + K (J - 1) c. Quadrature, shape functions and
numbering are NGSolve's, and so are the sums, to rounding.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from ngsolve import CF, TRIG, VOL, BilinearForm, ElementId, Integrate, IntegrationRule, specialcf, x
from numpy.typing import NDArray

from device.measurement.arrays import Array
from host_tools.forward.finite_strain.closed_contact import AXIAL, RADIAL
from host_tools.forward.finite_strain.hyperelasticity import NeoHookean
from host_tools.forward.symmetry import AXISYMMETRIC

Q_OF = {RADIAL: (0, 1, 4), AXIAL: (2, 3)}
"""Which parts of q an unknown acts on, in the order of `Points.shapes`: derivatives by r and z, value over r."""
SECOND_OF_J = ((0, 3, 4, 1), (1, 2, 4, -1), (0, 4, 3, 1), (3, 4, 0, 1), (1, 4, 2, -1), (2, 4, 1, -1))
"""Pairs of q and the one, with its sign, that is the second derivative of J by them."""


class Points(NamedTuple):
    """Quadrature points [p] of elements [n] with shape functions [m].

    `shapes` [n, 3, p, m]: derivatives by r and z, value over r. `weight` [n, p] in mm3, turned round the axis.
    """

    shapes: Array
    weight: Array

    @classmethod
    def of(cls, space: Any, elements: NDArray[np.int_]) -> Points:
        """Evaluate the shape functions of a scalar space in elements, where NGSolve integrates an energy.

        On the reference triangle they depend on the order of an element's vertex numbers alone.
        """
        mesh, order = space.mesh, space.globalorder
        rule = IntegrationRule(TRIG, 2 * order + AXISYMMETRIC.bonus_order)
        by_order: dict[tuple[int, ...], tuple[Array, Array]] = {}
        values, slopes = [], []
        for element in (ElementId(VOL, int(number)) for number in elements):
            key = tuple(np.argsort([vertex.nr for vertex in mesh[element].vertices]))
            if key not in by_order:
                by_order[key] = _on_reference(space.GetFE(element), rule)
            values.append(by_order[key][0])
            slopes.append(by_order[key][1])
        r_mm, jacobian = _mapped(mesh, rule, elements)
        value, slope = np.array(values) / r_mm[..., None], np.array(slopes) @ np.linalg.inv(jacobian)
        shapes = np.stack([slope[..., 0], slope[..., 1], value], axis=1)
        weights = np.array([point.weight for point in rule])
        return cls(shapes, weights * np.abs(np.linalg.det(jacobian)) * 2 * np.pi * r_mm)

    def seen(self, dofs: NDArray[np.int_], values: Array) -> Array:
        """Return derivatives and value over r [n, 3, p] of a function by its dofs [n, m]."""
        return np.asarray((self.shapes @ values[dofs][:, None, :, None])[..., 0])

    def relabelled(self, shift: Array) -> tuple[Points, Array]:
        """Return the points in terms of the material ones, r + a shift seen as [n, 3, p], and q at rest there."""
        d_r, d_z, hoop = 1 + shift[:, 0], shift[:, 1], 1 + shift[:, 2]
        by_r = self.shapes[:, 0] / d_r[..., None]
        by_z = self.shapes[:, 1] - d_z[..., None] * by_r
        shapes = np.stack([by_r, by_z, self.shapes[:, 2] / hoop[..., None]], axis=1)
        rest = np.stack([1 / d_r, -d_z / d_r, np.zeros_like(d_r), np.ones_like(d_r), 1 / hoop])
        return Points(shapes, self.weight * d_r * hoop), rest


class BodyEnergy:
    """A bilinear form as `EnergyNewton` uses one: the elements at the face by NGSolve, all others here."""

    def __init__(
        self, whole: BilinearForm, at_face: BilinearForm, elements: NDArray[np.int_], law: NeoHookean, spread: Any
    ) -> None:
        """Take the forms of all elements, which only lends its matrix, and of those at the face.

        `elements` are the numbers of all others, `spread` the shift of labels in them.
        """
        self.whole, self.at_face, self.spread, space = whole, at_face, spread, at_face.space
        scalar = space.components[RADIAL]
        self._still = Points.of(scalar, elements)
        dofs = np.array([scalar.GetDofNrs(ElementId(VOL, int(number))) for number in elements])
        self._dofs = {part: space.Range(part).start + dofs for part in Q_OF}
        self._label_dofs = np.array([_padded(spread.space, int(number), dofs.shape[1]) for number in elements])
        area, *moduli = (
            Integrate(of, space.mesh, element_wise=True).NumPy()[elements] for of in (CF(1), law.mu_kpa, law.bulk_kpa)
        )
        self._mu, self._bulk = (np.array(modulus / area)[:, None] for modulus in moduli)
        self._known = np.array([np.nan])
        self.mat: Any = None
        """The tangent as it was last assembled."""
        self._points, self._rest = self._still, np.zeros(0)

    def Energy(self, u: Any) -> float:  # noqa: N802 - NGSolve's name
        """Return the energy in uJ; it is no number where an element is inside out."""
        J, trace, _ = self._invariants(self._deformed(u))
        with np.errstate(invalid="ignore"):
            density = self._mu / 2 * (J ** (-2 / 3) * trace - 3) + self._bulk / 2 * (J - 1) ** 2
        return float(self.at_face.Energy(u)) + float(np.sum(density * self._points.weight))

    def Apply(self, u: Any, gradient: Any) -> None:  # noqa: N802 - NGSolve's name
        """Write the gradient in uJ/mm into a vector."""
        self.at_face.Apply(u, gradient)
        q = self._deformed(u)
        J, trace, c = self._invariants(q)
        with np.errstate(invalid="ignore"):
            shear = self._mu * J ** (-2 / 3)
        stress = (shear * q + (self._bulk * (J - 1) - shear * trace / (3 * J)) * c) * self._points.weight
        total = gradient.FV().NumPy()
        for part, of_q in Q_OF.items():
            shapes = self._points.shapes[:, : len(of_q)]
            pressed = np.moveaxis(stress[list(of_q)], 0, 1)[:, :, None, :]
            forces = (pressed @ shapes)[:, :, 0].sum(axis=1)
            total += np.bincount(self._dofs[part].ravel(), forces.ravel(), minlength=len(total))

    def AssembleLinearization(self, u: Any) -> None:  # noqa: N802 - NGSolve's name
        """Assemble the tangent in uJ/mm2."""
        self.at_face.AssembleLinearization(u)
        if self.mat is None:
            self._take_matrix(u)
        second = self._second_derivatives(self._deformed(u))
        entries = self.mat.AsVector().FV().NumPy()
        entries[:] = 0
        entries[self._face_places] = self.at_face.mat.AsVector().FV().NumPy()
        for parts, place in self._places.items():
            left, right = (self._points.shapes[:, : len(Q_OF[part])] for part in parts)
            block = sum(
                np.swapaxes(left[:, i], 1, 2) @ (second[a][b][..., None] * right[:, j])
                for i, a in enumerate(Q_OF[parts[0]])
                for j, b in enumerate(Q_OF[parts[1]])
            )
            entries += np.bincount(place.ravel(), np.asarray(block).ravel(), minlength=len(entries))

    def _deformed(self, u: Any) -> Array:
        """Return q [5, n, p]."""
        shift = self.spread.vec.FV().NumPy()
        if not np.array_equal(shift, self._known):
            self._known = shift.copy()
            seen = self._still.seen(self._label_dofs, np.append(shift, 0.0))
            self._points, self._rest = self._still.relabelled(seen)
        q, values = self._rest.copy(), u.FV().NumPy()
        for part, of_q in Q_OF.items():
            q[list(of_q)] += np.moveaxis(self._points.seen(self._dofs[part], values), 1, 0)[: len(of_q)]
        return q

    @staticmethod
    def _invariants(q: Array) -> tuple[Array, Array, Array]:
        """Return J [n, p], I1 [n, p] and c [5, n, p]."""
        rr, rz, zr, zz, hoop = q
        in_plane = rr * zz - rz * zr
        return in_plane * hoop, (q * q).sum(axis=0), np.stack([zz * hoop, -zr * hoop, -rz * hoop, rr * hoop, in_plane])

    def _second_derivatives(self, q: Array) -> list[list[Array]]:
        """Return d2W/dq2 [5][5] at the points [n, p], times their weight."""
        J, trace, c = self._invariants(q)
        with np.errstate(invalid="ignore"):
            shear = self._mu * J ** (-2 / 3) * self._points.weight
        bulk = self._bulk * self._points.weight
        mixed, both = -2 / 3 * shear / J, 5 / 9 * shear * trace / J**2 + bulk
        of_j = bulk * (J - 1) - shear * trace / (3 * J)
        second = [[mixed * (q[a] * c[b] + c[a] * q[b]) + both * c[a] * c[b] for b in range(5)] for a in range(5)]
        for a in range(5):
            second[a][a] += shear
        for a, b, other, sign in SECOND_OF_J:
            second[a][b] += sign * of_j * q[other]
            second[b][a] = second[a][b]
        return second

    def _take_matrix(self, u: Any) -> None:
        """Make the matrix, and find where the entries of each pair of unknowns [n, m, m] and of the face's form stand.

        A matrix of all elements is needed: NGSolve gives a form no entries where it has no energy.
        """
        self.whole.AssembleLinearization(u)
        self.mat = self.whole.mat.CreateMatrix()
        width = self.mat.width

        def numbers(matrix: Any) -> NDArray[np.int_]:
            rows, columns, _ = matrix.COO()
            return np.asarray(np.array(rows, dtype=np.int64) * width + np.array(columns))

        known = numbers(self.mat)
        order = np.argsort(known)

        def places(wanted: NDArray[np.int_]) -> NDArray[np.int_]:
            return order[np.searchsorted(known, wanted, sorter=order)]

        self._face_places = places(numbers(self.at_face.mat))
        self._places = {
            (a, b): places(self._dofs[a][:, :, None] * width + self._dofs[b][:, None, :]) for a in Q_OF for b in Q_OF
        }


def _on_reference(finite: Any, rule: Any) -> tuple[Array, Array]:
    """Return shape functions [p, m] and their slopes [p, m, 2] on the reference triangle."""
    places = [point.point[:2] for point in rule]
    values = np.array([finite.CalcShape(*place) for place in places])
    return values, np.array([finite.CalcDShape(*place) for place in places])


def _mapped(mesh: Any, rule: Any, elements: NDArray[np.int_]) -> tuple[Array, Array]:
    """Return the radius (mm) [n, p] and the Jacobian [n, p, 2, 2] of quadrature points, the mesh as it is now."""
    points = mesh.MapToAllElements({TRIG: rule}, mesh.Materials(".*"))
    r_mm = np.asarray(CF(x)(points)).reshape(mesh.ne, len(rule))
    jacobian = np.asarray(specialcf.JacobianMatrix(2)(points)).reshape(mesh.ne, len(rule), 2, 2)
    return r_mm[elements], jacobian[elements]


def _padded(space: Any, element: int, count: int) -> list[int]:
    """Return the dofs of labels in an element; in the probe, which has none, one behind the last for each."""
    return list(space.GetDofNrs(ElementId(VOL, element))) or [space.ndof] * count
