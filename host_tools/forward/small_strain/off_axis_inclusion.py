"""An inclusion in a body that is round but for it: the press without it in axisymmetry, and in 3-D what it changes.

Let C + dC be the stiffness of the inclusion and C that of the tissue it lies in. The displacement is u0 + d, where u0
is the press without the inclusion and d, at rest on back and base, solves

    int (C + dC) e(d) : e(v) = - int dC e(u0) : e(v)    for every admissible v,

whose right side is over the inclusion alone. So one stiffness is factorised in 3-D instead of two, and the
singular rims of the press, which rule the error of its force, are solved in axisymmetry, where they cost nothing.
Source: Mura, Micromechanics of Defects in Solids (1987), section 22, on the equivalent inclusion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from ngsolve import CF, GridFunction, LinearForm, dx, x, y, z
from ngsolve.comp import IntegrationRuleSpace

from device.measurement.arrays import Array
from host_tools.forward.face_state import MN_PER_N, FaceState
from host_tools.forward.materials import INCLUSION, Elasticity
from host_tools.forward.press_model import Loaded
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.contact import contact_pressure_kpa, integral_over_face
from host_tools.forward.small_strain.elasticity import Stress, lame_modulus_kpa, shear_modulus_kpa, stress, work
from host_tools.forward.small_strain.folding import Folding
from host_tools.forward.small_strain.linear_model import at_press, require_reach
from host_tools.forward.small_strain.linear_press import LinearPress, SolvedPress
from host_tools.forward.symmetry import AXISYMMETRIC, SOLID, Strain
from host_tools.scenes.scene import Press, Scene

ROUND_ORDER = 8
"""Of the press without the inclusion, on layered rims: its force is then good to some 1e-4 of itself."""
FOLDING_ORDER = 2
"""Of the whole displacement in 3-D that tells how far a press may go; its limit lies within a tenth of order 4's."""
NEAREST_AXIS_MM = 1e-6
"""u_r / r is 0/0 on the axis."""


def is_round_but_for_inclusion(scene: Scene) -> bool:
    """Return whether a scene would be axisymmetric and flat-faced without its inclusion."""
    probe = scene.waveguide
    return scene.has_inclusion and probe.face == "round" and probe.dome_mm == 0 and scene.tissue.edge_mm is None


class RoundBody(NamedTuple):
    """The half plane of the body without its inclusion, what it is made of, and what samples its face."""

    mesh: Any
    elasticity: Elasticity
    sampler: FaceSampler


class OffAxisModel:
    """An inclusion off the axis as a `PressModel`, in small strain and displacements alone."""

    def __init__(self, mesh: Any, sampler: FaceSampler, without: RoundBody, *, order: int, other_order: int) -> None:
        self.mesh, self.sampler, self.without = mesh, sampler, without
        self.order, self.other_order = order, other_order
        self._pressed_without = cache(self._solved_without)

    def press(self, elasticity: Elasticity, presses: Sequence[Press], *, estimate_error: bool) -> tuple[Loaded, ...]:
        """Return the face at every press, at the model's order and at the other; raise `PressFailed` where it folds."""
        unit = self._unit(elasticity, self.order)
        require_reach(presses, unit, self._folding(elasticity))
        other = self._unit(elasticity, self.other_order) if estimate_error else None
        return tuple(
            Loaded(at_press(press, unit), None if other is None else at_press(press, other)) for press in presses
        )

    def _unit(self, elasticity: Elasticity, order: int) -> FaceState:
        """Return the face under the unit press; the round body's order follows that of the inclusion's."""
        pressed = self._pressed_without(ROUND_ORDER + order - self.order)
        plain = pressed.press.face_state(pressed.u, pressed.elasticity, self.without.sampler)
        state = on_all_rays(plain, self.sampler)
        if elasticity == pressed.elasticity:
            return state
        return _sum(state, Difference(self.mesh, order, elasticity, pressed).face_state(self.sampler))

    def _solved_without(self, order: int) -> SolvedPress:
        return SolvedPress(LinearPress(self.without.mesh, AXISYMMETRIC, order), self.without.elasticity)

    def _folding(self, elasticity: Elasticity) -> Folding:
        if elasticity == self.without.elasticity:
            solved = self._pressed_without(ROUND_ORDER)
        else:
            solved = SolvedPress(LinearPress(self.mesh, SOLID, FOLDING_ORDER), elasticity)
        return Folding(solved.press.contact, solved.u)


class Difference:
    """What an inclusion adds to the unit press of the body without it, on a 3-D mesh at an order."""

    def __init__(self, mesh: Any, order: int, elasticity: Elasticity, without: SolvedPress) -> None:
        self.press, self.elasticity = LinearPress(mesh, SOLID, order), elasticity
        points = IntegrationRuleSpace(mesh, order=2 * order, definedon=mesh.Materials(INCLUSION))
        self._over_inclusion = dx(INCLUSION, intrules=points.GetIntegrationRules())
        at_mm = (_at_points(points, axis) for axis in (x, y, z))
        strain = _as_strain(points, round_strain(without, *at_mm))
        self._polarisation = self._further_stress(strain, without.elasticity)
        self.d = SolvedPress(self.press, elasticity, sinking_mm=0.0).under(self._load())

    def face_state(self, sampler: FaceSampler) -> FaceState:
        """Return what the face does more; nothing is pressed further in, so the indentation is 0."""
        press, mesh = self.press, self.press.mesh
        probe, _ = press.contact.bodies(self.d.components)
        pressure = contact_pressure_kpa(mesh, SOLID, press.order, press.stress_of_probe(self.d, self.elasticity))
        return FaceState(
            indentation_mm=0.0,
            w_mm=sampler(probe.u[-1]),
            p_kpa=sampler(pressure),
            total_mm3=sampler.copies * integral_over_face(mesh, SOLID, probe.u[-1]),
            force_n=sampler.copies * press.reaction_mn(self.d, self.elasticity) / MN_PER_N,
            contact_force_n=sampler.copies * integral_over_face(mesh, SOLID, pressure) / MN_PER_N,
        )

    def _load(self) -> Any:
        """Return the load (mN) of the polarisation on every test function."""
        space = self.press.contact.space
        load, (_, tissue) = LinearForm(space), self.press.contact.bodies(space.TestFunction())
        load += -work(self._polarisation, SOLID.strain(tissue.u)) * self._over_inclusion
        load.Assemble()
        return load.vec

    def _further_stress(self, e: Strain, plain: Elasticity) -> Stress:
        """Return dC : e, by how much the inclusion's stress is above the tissue's under the same strain (kPa)."""

        def stressed(elasticity: Elasticity) -> Stress:
            E, nu = elasticity.fields(self.press.mesh)
            return stress(e, shear_modulus_kpa(E, nu), lame_modulus_kpa(E, nu) * e.trace)

        stiff, soft = stressed(self.elasticity), stressed(plain)
        return Stress(
            tuple(a - b for a, b in zip(stiff.normal, soft.normal, strict=True)),
            tuple(a - b for a, b in zip(stiff.shear, soft.shear, strict=True)),
        )


def round_strain(pressed: SolvedPress, x_mm: Array, y_mm: Array, z_mm: Array) -> Array:
    """Return the tissue's strain of an axisymmetric press at points [n], as [6, n]: xx, yy, zz, xy, yz, zx."""
    r_mm = np.maximum(np.hypot(x_mm, y_mm), NEAREST_AXIS_MM)
    _, tissue = pressed.press.contact.bodies(pressed.u.components)
    e = AXISYMMETRIC.strain(tissue.u)
    found = CF((*e.normal, *e.shear))(pressed.press.mesh(r_mm, z_mm))
    rr, tt, zz, rz = np.asarray(found).T
    cos, sin = x_mm / r_mm, y_mm / r_mm
    xx, yy, xy = rr * cos**2 + tt * sin**2, rr * sin**2 + tt * cos**2, (rr - tt) * sin * cos
    return np.stack([xx, yy, zz, xy, rz * sin, rz * cos])


def on_all_rays(state: FaceState, sampler: FaceSampler) -> FaceState:
    """Return a state of one ray on the rays of a 3-D face: all alike."""
    w_mm, p_kpa = (np.broadcast_to(one, sampler.shape) for one in (state.w_mm, state.p_kpa))
    return replace(state, w_mm=w_mm, p_kpa=p_kpa)


def _sum(state: FaceState, more: FaceState) -> FaceState:
    return FaceState(
        state.indentation_mm + more.indentation_mm,
        state.w_mm + more.w_mm,
        state.p_kpa + more.p_kpa,
        state.total_mm3 + more.total_mm3,
        state.force_n + more.force_n,
        state.contact_force_n + more.contact_force_n,
    )


def _at_points(points: Any, field: Any) -> Array:
    """Return a field's values [n] at the integration points of a space."""
    values = GridFunction(points)
    values.Interpolate(field)
    return np.array(values.vec.FV().NumPy())


def _as_strain(points: Any, values: Array) -> Strain:
    """Return strains [6, n] at integration points as what can be integrated."""
    fields = []
    for component in values:
        field = GridFunction(points)
        field.vec.FV().NumPy()[:] = component
        fields.append(field)
    return Strain(tuple(fields[:3]), tuple(fields[3:]))
