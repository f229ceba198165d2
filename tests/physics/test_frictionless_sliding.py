"""Frictionless means: the traction has no component along the *deformed* face. Sliding has none."""

from ngsolve import GridFunction, IfPos, InnerProduct, grad, x

from device.measurement.quantities import Inclusion
from host_tools.forward.finite_strain.closed_contact import AXIAL, RADIAL
from host_tools.forward.finite_strain.equilibrium_path import EquilibriumPath
from host_tools.forward.finite_strain.sliding import SlidingContact
from host_tools.forward.materials import with_inclusion
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.scenes.scene import Scene

SCENE = Scene(Inclusion(10, 4, 120))
CENTRAL_MM = 9.0


def _power_along_face():
    """Return the power of the probe's contact force on a unit slip along the face, over that on a unit approach."""
    size = Resolution(4, 2, 1, 1, per_inclusion=4, grading=0.6)
    contact = SlidingContact(axisymmetric_mesh(SCENE, order=3, resolution=size), with_inclusion(SCENE), 3)
    EquilibriumPath(contact).press_to(1.5)
    u_r, u_z = contact.u.components[RADIAL], contact.u.components[AXIAL]
    window = IfPos(CENTRAL_MM - x, x * (CENTRAL_MM - x) ** 2 / 100, 0)
    residual, slip, approach = (
        contact.u.vec.CreateVector(),
        GridFunction(contact.u.space),
        GridFunction(contact.u.space),
    )
    contact.probe_energy.Apply(contact.u.vec, residual)
    face = contact.mesh.Boundaries("face")
    slip.components[RADIAL].Set(window * (1 + grad(u_r)[0]), definedon=face)
    slip.components[AXIAL].Set(window * grad(u_z)[0], definedon=face)
    approach.components[AXIAL].Set(window, definedon=face)
    return abs(InnerProduct(residual, slip.vec) / InnerProduct(residual, approach.vec))


def test_the_traction_of_a_sliding_face_is_normal_to_it():
    assert _power_along_face() < 2e-5
