"""A press in equilibrium to how its face changes, at equal force, with every quantity that is not exactly known.

Derivatives by the logarithms of the inclusion's size, depth and modulus, of the tissue's modulus and thickness, and of
the force; the probe itself stays as it is, so its pressure changes by the motion alone. One linear solve each with the
tangent of the state; what moves the mesh is differenced along a mesh velocity, at the fixed state, where a step of 1e-4
is good to 1e-7. The indentation then gives way until the force is the same. Source: Haslinger & Makinen, Introduction
to Shape Optimization (2003), section 3.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import log
from typing import Any

from ngsolve import H1, GridFunction, InnerProduct

from device.measurement.arrays import Array
from host_tools.forward.derivatives.equilibrium import Equilibrium
from host_tools.forward.derivatives.form_action import StateVector, along
from host_tools.forward.face_state import MN_PER_N, FaceState
from host_tools.forward.small_strain.contact import pressure_of_forces

FORCE = "force_n"


@dataclass(frozen=True)
class FaceRate:
    """Change of the face by one quantity: fields [A, R] at the samples of the rays, and the indentation."""

    w_mm: Array
    p_kpa: Array
    indentation_mm: float

    def scaled(self, factor: float) -> FaceRate:
        """Return the change of a linear body at another load."""
        return FaceRate(self.w_mm * factor, self.p_kpa * factor, self.indentation_mm * factor)


@dataclass(frozen=True)
class FaceSensitivity:
    """A face and its derivatives at equal force, by the logarithm of each quantity; `force_n` is one of them."""

    face: FaceState
    rates: Mapping[str, FaceRate]

    def scaled(self, factor: float) -> FaceSensitivity:
        """Return the sensitivity of a linear body at another load."""
        rates = {name: rate.scaled(factor) for name, rate in self.rates.items()}
        return FaceSensitivity(self.face.scaled(factor), rates)

    def at_force(self, force_n: float) -> FaceSensitivity:
        """Return the sensitivity at a force close by: the face to first order, the derivatives in proportion."""
        ratio, more = force_n / self.face.force_n, self.rates[FORCE]
        step = log(ratio)
        face = replace(
            self.face,
            indentation_mm=self.face.indentation_mm + step * more.indentation_mm,
            w_mm=self.face.w_mm + step * more.w_mm,
            p_kpa=self.face.p_kpa + step * more.p_kpa,
            total_mm3=self.face.total_mm3 * ratio,
            force_n=force_n,
            contact_force_n=self.face.contact_force_n * ratio,
        )
        return FaceSensitivity(face, {name: rate.scaled(ratio) for name, rate in self.rates.items()})


def face_sensitivity(press: Equilibrium, velocities: Mapping[str, Any]) -> FaceSensitivity:
    """Return the derivatives of a face by every mesh velocity, every modulus of the press, and the force."""
    with_press = press.push.CreateVector()
    with_press.data = press.push - press.solve(press.tangent(press.push))
    back = _back(press)
    stiffness = InnerProduct(press.tangent(with_press), back)
    changes = {name: along(velocity, press.mesh, press.forces) for name, velocity in velocities.items()}
    changes |= {name: press.forces_by(name) for name in press.moduli}
    more_mm = press.face.force_n * MN_PER_N / press.sampler.copies / stiffness  # the stiffness is of the part modelled
    rates = {FORCE: _rate(press, more_mm * with_press, more_mm)}
    for name, forces in changes.items():
        held = press.held_by(name)
        motion = press.push.CreateVector()
        motion.data = held - press.solve(forces + press.tangent(held))
        more_mm = -(InnerProduct(forces, back) + InnerProduct(press.tangent(motion), back)) / stiffness
        motion.data += more_mm * with_press
        rates[name] = _rate(press, motion, more_mm)
    return FaceSensitivity(press.face, rates)


def _back(press: Equilibrium) -> StateVector:
    push = GridFunction(press.space)
    push.components[press.axial].Set(-1.0, definedon=press.mesh.Boundaries("back"))
    return push.vec


def _rate(press: Equilibrium, motion: Any, more_mm: float) -> FaceRate:
    change, forces = GridFunction(press.space), GridFunction(press.space)
    change.vec.data = motion
    forces.vec.data = press.probe_tangent(change.vec)
    space = H1(press.mesh, order=press.order)  # over both bodies: a point of the face may be in either
    pressure = pressure_of_forces(space, press.symmetry, forces.components[press.axial].vec)
    w_mm = change.components[press.axial] + more_mm
    return FaceRate(press.sampler(w_mm), press.sampler(pressure), more_mm)
