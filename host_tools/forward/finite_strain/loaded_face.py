"""A pressed contact to what is read off it: face, pressure, reactions, slip and stored energy.

Forces come from residuals, never from sampled stresses: back, face and base then balance to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ngsolve import H1, GridFunction, InnerProduct

from device.measurement.arrays import Array
from host_tools.forward.face_state import MN_PER_N, FaceState
from host_tools.forward.finite_strain.closed_contact import AXIAL, RADIAL, ClosedContact
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.contact import integral_over_face, pressure_of_forces
from host_tools.forward.symmetry import AXISYMMETRIC


@dataclass(frozen=True)
class LoadedFace:
    """The face at one load of a path, and how it was got; profiles are [A, R] at the samples of the rays.

    `slip_mm` is the radius of the tissue's material point under a sample minus the sample's own: negative where the
    tissue has slid outwards. `force_n` of the face is the reaction of the back and must equal `base_force_n`.
    `newton_iterations` counts every one since the load before. `refined` is the same face after corrections at the
    next order: its difference estimates the error of discretisation.
    """

    face: FaceState
    slip_mm: Array
    base_force_n: float
    energy_uj: float
    newton_iterations: int
    seconds: float
    refined: FaceState | None = None


def reaction_n(contact: ClosedContact, boundary: str) -> float:
    """Return the force (N) with which a held boundary pushes its body down (the back) or, negative, up (the base)."""
    push = GridFunction(contact.u.space)
    push.components[AXIAL].Set(-1.0, definedon=contact.mesh.Boundaries(boundary))
    return float(InnerProduct(_gradient(contact.fast_energy, contact.u), push.vec)) / MN_PER_N


def face_state(contact: ClosedContact, indentation_mm: float, sampler: FaceSampler) -> FaceState:
    """Return the face of a contact in equilibrium."""
    w_mm = contact.u.components[AXIAL] + indentation_mm
    pressure = contact_pressure_kpa(contact)
    return FaceState(
        indentation_mm=indentation_mm,
        w_mm=sampler(w_mm),
        p_kpa=sampler(pressure),
        total_mm3=integral_over_face(contact.mesh, AXISYMMETRIC, w_mm),
        force_n=reaction_n(contact, "back"),
        contact_force_n=integral_over_face(contact.mesh, AXISYMMETRIC, pressure) / MN_PER_N,
        outward_mm=sampler(contact.u.components[RADIAL]),
    )


def contact_pressure_kpa(contact: ClosedContact) -> Any:
    """Return the axial force on the face per undeformed area of the probe (kPa, positive in compression).

    It balances the gradient of the probe's energy, int p v dA = dW_probe(v e_z) for every v on the face, so its
    integral is the reaction; the direction of the traction, normal to the deformed face, does not enter.
    """
    residual = GridFunction(contact.u.space)
    residual.vec.data = _gradient(contact.probe_energy, contact.u)
    space = H1(contact.mesh, order=contact.order)  # over both bodies: a point of the face may be in either
    return pressure_of_forces(space, AXISYMMETRIC, residual.components[AXIAL].vec)


def _gradient(energy: Any, u: Any) -> Any:
    gradient = u.vec.CreateVector()
    energy.Apply(u.vec, gradient)
    return gradient
