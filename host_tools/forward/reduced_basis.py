"""Any Young's modulus at a fixed geometry in a fraction of a millisecond, from a few solved ones.

Stiffness is affine in the inclusion's modulus, K(E) = K0 + E K1, and the solution is smooth in ln E: the energy is
minimised over combinations of snapshots whose weights sum to one, so that each keeps the indentation. Four snapshots
at Chebyshev points of 40-120 kPa are good to 1e-8. Source: Quarteroni, Manzoni & Negri, Reduced Basis Methods for PDEs
(2016), chapter 3.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from ngsolve import BilinearForm, InnerProduct

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.forward.face_state import MN_PER_N, FaceState, Rays
from host_tools.forward.materials import Elasticity, baseline, with_inclusion
from host_tools.forward.plan import ModelPlan, aligned, model_plan
from host_tools.forward.small_strain.linear_press import LinearPress, at_press
from host_tools.forward.solution import Solution
from host_tools.forward.tiers import build
from host_tools.scenes.scene import Scene

SNAPSHOTS = 4
SMALLEST_MODE = 1e-14
"""Directions with less of the snapshots' energy than this are rounding, not information."""


class ReducedBasis:
    """Solves one geometry for any modulus of its inclusion between two bounds; linear presses only."""

    def __init__(
        self,
        scene: Scene,
        low_kpa: float,
        high_kpa: float,
        *,
        snapshots: int = SNAPSHOTS,
        plan: ModelPlan | None = None,
    ) -> None:
        """Solve the snapshots; raise `InvalidQuantity` for a scene without inclusion or a nonlinear plan."""
        if scene.inclusion is None or scene.inclusion.size_mm == 0:
            raise InvalidQuantity("inclusion", "none", "one whose modulus may vary", "give the scene an inclusion")
        self.low_kpa = require("low_kpa", low_kpa, Bound(0.0, 1e9, "kPa", low_included=False), "give a modulus")
        self.high_kpa = require("high_kpa", high_kpa, Bound(low_kpa, 1e9, "kPa", low_included=False), "give a modulus")
        # any modulus but the tissue's own, so that the inclusion is meshed
        self.scene = replace(scene, inclusion=replace(scene.inclusion, youngs_modulus_kpa=high_kpa))
        self.plan = plan or model_plan(self.scene)
        if self.plan.contact != "closed_sliding" or self.plan.formulation != "displacement":
            raise InvalidQuantity("plan", self.plan.contact, "linear in the press", "ask for small strain, a flat face")
        self._solve(snapshots)

    def _solve(self, snapshots: int) -> None:
        turned, self.angle_rad = aligned(self.scene)
        meshed = build(turned, self.plan)
        self.rays, self.elements, sampler = meshed.rays, meshed.elements, meshed.sampler
        press = LinearPress(meshed.mesh, meshed.symmetry, self.plan.order)
        plain = baseline(turned)
        self.bare = press.face_state(press.displacement(plain), plain, sampler)
        materials = [_with_modulus(turned, modulus) for modulus in self._nodes_kpa(snapshots)]
        fields = [press.displacement(material) for material in materials]
        self.faces = [press.face_state(u, m, sampler) for u, m in zip(fields, materials, strict=True)]
        self.fixed = sampler.copies * _work(press, fields, _scaled(materials[0], around=1.0, inclusion=0.0))
        self.per_kpa = sampler.copies * _work(press, fields, _scaled(materials[0], around=0.0, inclusion=1.0))
        self.modes = self._independent_modes()

    def _nodes_kpa(self, snapshots: int) -> Array:
        nodes = np.cos(np.pi * (np.arange(snapshots) + 0.5) / snapshots)
        low, high = np.log(self.low_kpa), np.log(self.high_kpa)
        return np.asarray(np.exp((low + high) / 2 + (high - low) / 2 * nodes))

    def _independent_modes(self) -> Array:
        """Return combinations of weights that sum to zero, orthonormal in the energy: each row one."""
        n = len(self.faces)
        differences = np.eye(n)[1:] - np.eye(n)[0]
        energy = self.fixed + np.sqrt(self.low_kpa * self.high_kpa) * self.per_kpa
        values, vectors = np.linalg.eigh(differences @ energy @ differences.T)
        kept = values > SMALLEST_MODE * energy[0, 0]
        return np.asarray((vectors[:, kept] / np.sqrt(values[kept])).T @ differences)

    def weights(self, youngs_modulus_kpa: float) -> Array:
        """Return the snapshots' weights at a modulus; raise `InvalidQuantity` outside the bounds."""
        bound = Bound(self.low_kpa, self.high_kpa, "kPa")
        E = require("youngs_modulus_kpa", youngs_modulus_kpa, bound, "build the basis over a wider range")
        stiffness = self.fixed + E * self.per_kpa
        first = np.eye(len(self.faces))[0]
        amplitudes = np.linalg.solve(self.modes @ stiffness @ self.modes.T, -self.modes @ stiffness @ first)
        return np.asarray(first + amplitudes @ self.modes)

    def face(self, youngs_modulus_kpa: float) -> FaceState:
        """Return the face at 1 mm of indentation."""
        weights = self.weights(youngs_modulus_kpa)
        energy = float(weights @ (self.fixed + youngs_modulus_kpa * self.per_kpa) @ weights)

        def mix(name: str) -> Array:
            return np.asarray(sum(w * getattr(face, name) for w, face in zip(weights, self.faces, strict=True)))

        indentation_mm = self.faces[0].indentation_mm
        return FaceState(
            indentation_mm=indentation_mm,
            w_mm=mix("w_mm"),
            p_kpa=mix("p_kpa"),
            total_mm3=float(mix("total_mm3")),
            force_n=energy / indentation_mm / MN_PER_N,
            contact_force_n=float(mix("contact_force_n")),
        )

    def solution(self, youngs_modulus_kpa: float) -> Solution:
        """Return the solution under the scene's press; it states no error of its own."""
        pressed, bare = (at_press(self.scene.press, face) for face in (self.face(youngs_modulus_kpa), self.bare))
        rays = Rays(self.rays.angle_rad + self.angle_rad, self.rays.r_mm)
        return Solution(rays, pressed, bare, self.plan, self.elements, {})


def _with_modulus(scene: Scene, modulus_kpa: float) -> Elasticity:
    assert scene.inclusion is not None  # checked before anything was solved
    return with_inclusion(replace(scene, inclusion=replace(scene.inclusion, youngs_modulus_kpa=modulus_kpa)))


def _scaled(elasticity: Elasticity, *, around: float, inclusion: float) -> Elasticity:
    """Return materials whose stiffness matrix is K0 (around 1, inclusion 0) or K1 (around 0, inclusion 1 kPa)."""
    modulus = {
        name: inclusion if name.startswith("inclusion") else around * value
        for name, value in elasticity.modulus_kpa.items()
    }
    return Elasticity(modulus, elasticity.poisson_ratio)


def _work(press: LinearPress, fields: list[object], elasticity: Elasticity) -> Array:
    """Return the work of every snapshot's stress on every snapshot's strain (mN mm) for given materials."""
    form = BilinearForm(press.contact.space, symmetric=True)
    trial, test = press.contact.space.TnT()
    for term in press.weak_form(elasticity, trial, test):
        form += term
    form.Assemble()
    image = form.mat.CreateColVector()
    work = np.empty((len(fields), len(fields)))
    for j, u in enumerate(fields):
        image.data = form.mat * u.vec  # type: ignore[attr-defined]
        work[:, j] = [InnerProduct(image, v.vec) for v in fields]  # type: ignore[attr-defined]
    return work
