"""Velocities of a mesh: the inclusion grows and moves as asked, the rest follows, and nothing else moves."""

import numpy as np
import pytest
from ngsolve import CF, Integrate, dx, x

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.derivatives.mesh_velocity import mesh_velocities, moved
from host_tools.forward.materials import INCLUSION
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.forward.meshes.morph import morphed_mesh
from host_tools.scenes.scene import Scene, Tissue, TissueLayer

SCENE = Scene(Inclusion(10, 6, 80))
COARSE = Resolution(6, 2, 1, 1, per_inclusion=4, grading=0.7)


@pytest.fixture(scope="module", params=[axisymmetric_mesh, morphed_mesh])
def mesh(request):
    return request.param(SCENE, order=3, resolution=COARSE)


@pytest.fixture(scope="module")
def velocities(mesh):
    return mesh_velocities(SCENE, mesh)


def volume_mm3(mesh):
    return Integrate(2 * np.pi * x * dx(INCLUSION), mesh)


def logarithmic_rate(mesh, velocity):
    with moved(mesh, velocity, 1e-3):
        more = volume_mm3(mesh)
    with moved(mesh, velocity, -1e-3):
        less = volume_mm3(mesh)
    return np.log(more / less) / 2e-3


@pytest.mark.parametrize(("quantity", "power"), [("size_mm", 3.0), ("depth_mm", 0.0), ("thickness_mm", 0.0)])
def test_the_inclusions_volume_goes_with_the_cube_of_its_size_alone(mesh, velocities, quantity, power):
    assert logarithmic_rate(mesh, velocities[quantity]) == pytest.approx(power, abs=1e-5)


def test_the_inclusion_sinks_as_a_whole_and_grows_from_its_top(mesh, velocities):
    def at(name, boundary):
        points = CF(tuple(velocities[name]))
        return float(np.abs(Integrate(points[1] * dx(INCLUSION), mesh) / Integrate(CF(1) * dx(INCLUSION), mesh)))

    assert at("depth_mm", "sphere") == pytest.approx(6.0, rel=1e-6)
    assert at("size_mm", "sphere") == pytest.approx(5.0, rel=1e-3)  # its middle: half a diameter for the whole of it


def test_face_skin_and_probe_stand_still(mesh, velocities):
    for velocity in velocities.values():
        for r_mm, z_mm in ((0.0, 1e-6), (10.0, 1e-6), (5.0, 8.0), (30.0, -1e-6)):
            assert np.abs(velocity(mesh(r_mm, z_mm))).max() < 1e-5


def test_the_base_moves_with_the_thickness(mesh, velocities):
    assert velocities["thickness_mm"](mesh(20.0, -30.0 + 1e-9))[1] == pytest.approx(-30.0, rel=1e-6)
    assert np.abs(velocities["size_mm"](mesh(20.0, -30.0 + 1e-9))).max() < 1e-6


def fail_on_a_moved_mesh(mesh, velocity):
    before = volume_mm3(mesh)
    with moved(mesh, velocity, 0.1):
        assert volume_mm3(mesh) > 1.2 * before
        raise ZeroDivisionError


def test_a_mesh_is_moved_back_even_when_the_work_on_it_fails(mesh, velocities):
    before = volume_mm3(mesh)
    with pytest.raises(ZeroDivisionError):
        fail_on_a_moved_mesh(mesh, velocities["size_mm"])
    assert volume_mm3(mesh) == before


@pytest.mark.parametrize(
    ("scene", "quantity"),
    [
        (Scene(None), "inclusion"),
        (Scene(Inclusion(8, 6, 80), tissue=Tissue(layers=(TissueLayer("fat", 4, 3),))), "tissue.layers"),
    ],
)
def test_what_cannot_be_moved_is_refused(mesh, scene, quantity):
    with pytest.raises(InvalidQuantity) as refusal:
        mesh_velocities(scene, mesh)
    assert refusal.value.quantity == quantity
