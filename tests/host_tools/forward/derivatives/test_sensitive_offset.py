"""A press beside the inclusion: its derivative by the place is the limit of differences, and moves the field."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.derivatives import sensitive_presses as module
from host_tools.forward.derivatives.mesh_velocity import OFFSET, mesh_velocities, moved
from host_tools.forward.derivatives.sensitive_presses import GRADING, sensitive_offset
from host_tools.forward.materials import with_inclusion
from host_tools.forward.plan import model_plan
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.tiers import build
from host_tools.scenes.scene import Placement, Scene

pytestmark = pytest.mark.long
SCENE, ORDER, FORCE_N = Scene(Inclusion(10, 6, 80)), 1, 0.5
ASIDE = replace(SCENE, placement=Placement(offset_x_mm=6.0))


@pytest.fixture(scope="module")
def meshed():
    return build(ASIDE, replace(model_plan(ASIDE), grading=GRADING))


@pytest.fixture(scope="module")
def found(meshed):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "ORDERS", (ORDER,))
        patch.setattr(module, "build", lambda *_: meshed)
        return sensitive_offset(SCENE, 6.0, FORCE_N)[ORDER]


def test_differences_tend_to_the_derivative(found, meshed):
    velocity = mesh_velocities(ASIDE, meshed.mesh)[OFFSET]

    def w_mm(share):
        with moved(meshed.mesh, velocity, share):
            press, elasticity = LinearPress(meshed.mesh, meshed.symmetry, ORDER), with_inclusion(ASIDE)
            face = press.face_state(press.displacement(elasticity), elasticity, meshed.sampler)
        return face.w_mm * FORCE_N / face.force_n

    rate = found.pressed.rates[OFFSET].w_mm
    difference = (w_mm(0.1) - w_mm(-0.1)) / 0.2
    assert np.abs(difference - rate).max() < 1e-3 * np.abs(rate).max()


def test_the_inclusion_field_moves_with_the_inclusion(found):
    """An inclusion 6 mm out that goes further lowers its field on the axis and raises it towards the rim."""
    field, rate = (
        found.pressed.face.w_mm - found.baseline.face.w_mm,
        found.pressed.rates[OFFSET].w_mm - found.baseline.rates[OFFSET].w_mm,
    )
    beyond = np.searchsorted(found.rays.r_mm[0], 9.0)
    assert field[0, beyond] > field[len(field) // 2, beyond]
    assert rate[0, 0] < 0 < rate[0, beyond]


def test_both_faces_carry_the_force(found):
    for face in (found.pressed.face, found.baseline.face):
        assert face.force_n == pytest.approx(FORCE_N)
        assert face.contact_force_n == pytest.approx(FORCE_N, rel=2e-3)
