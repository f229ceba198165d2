"""A solved press in small strain to how deep it may go before matter passes through itself.

Small strain scales to any load and never complains: a probe of 10 mm can be pressed 487 mm into a slab of 30 mm. What
gives it away is the Jacobian det(I + grad u), which turns negative where matter is turned inside out. At a sharp rim
it does so under any load, in a volume that vanishes; so what counts is the share of the volume under the face.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from ngsolve import CF, HEX, PRISM, PYRAMID, QUAD, TET, TRIG, IntegrationRule, grad, specialcf, x

from device.measurement.arrays import Array
from host_tools.forward.small_strain.contact import Body, ContactSpace, integral_over_face
from host_tools.forward.symmetry import SOLID

FOLDED_RATIO = 1e-3
"""Largest share of a body under the face that may be turned inside out; steep: half of it 3 % less deep."""
HALVINGS = 40
POINTS_ORDER = 4
SHAPES = {2: (TRIG, QUAD), 3: (TET, PRISM, HEX, PYRAMID)}


class Folding:
    """Both bodies under a solved displacement: how much of each is turned inside out when it is scaled."""

    def __init__(self, contact: ContactSpace, u: Any) -> None:
        self.slab_mm = -min(vertex.point[-1] for vertex in contact.mesh.vertices)
        self._columns = [_Column(contact, body, self.slab_mm) for body in contact.bodies(u.components)]

    def folds(self, scale: float = 1.0) -> bool:
        """Return whether either body is, in more than `FOLDED_RATIO` of it under the face, under so many presses."""
        return any(column.folded_ratio(scale) > FOLDED_RATIO for column in self._columns)

    def largest_scale(self, most: float) -> float:
        """Return the largest scale up to `most` that folds nothing."""
        if not self.folds(most):
            return most
        low, high = 0.0, most
        for _ in range(HALVINGS):
            middle = (low + high) / 2
            low, high = (low, middle) if self.folds(middle) else (middle, high)
        return low


class _Column:
    """One body at integration points: displacement gradients [points, 3, 3], and volumes over that under the face."""

    def __init__(self, contact: ContactSpace, body: Body, slab_mm: float) -> None:
        mesh, symmetry = contact.mesh, contact.symmetry
        region = mesh.Materials(body.materials)
        rules = {shape: IntegrationRule(shape, POINTS_ORDER) for shape in SHAPES[mesh.dim]}
        points = mesh.MapToAllElements(rules, region)
        weights = np.concatenate([rules[element.type].weights for element in region.Elements()])
        mapping = np.asarray(specialcf.JacobianMatrix(mesh.dim)(points)).reshape(-1, mesh.dim, mesh.dim)
        density = np.asarray(CF(symmetry.weight)(points)).ravel()
        below = "layer" not in body.materials
        volumes = weights * np.abs(np.linalg.det(mapping)) * density
        under_face_mm3 = integral_over_face(mesh, symmetry, CF(1.0)) * slab_mm if below else volumes.sum()
        self.gradient, self.share = _gradient(contact, body, points), volumes / under_face_mm3

    def folded_ratio(self, scale: float) -> float:
        """Return how much is turned inside out, over the volume under the face."""
        return float(self.share[_is_folded(np.eye(3) + scale * self.gradient)].sum())


def _gradient(contact: ContactSpace, body: Body, points: Any) -> Array:
    """Return grad u [points, 3, 3]; in axisymmetry the hoop strain is apart from the plane."""
    rows = [np.asarray(grad(component)(points)) for component in body.u]
    if contact.symmetry is SOLID:
        return np.stack(rows, axis=1)
    gradient = np.zeros((len(rows[0]), 3, 3))
    gradient[:, :2, :2] = np.stack(rows, axis=1)
    gradient[:, 2, 2] = np.asarray((body.u[0] / x)(points)).ravel()
    return gradient


def _is_folded(deformation: Array) -> Array:
    """Return which gradients [points, 3, 3] turn matter inside out.

    Two turned directions hide in the determinant; so the last stretch, of the hoop or along the press, counts too.
    """
    return np.asarray((np.linalg.det(deformation) <= 0) | (deformation[:, 2, 2] <= 0))
