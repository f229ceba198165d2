"""What a solution states of its error, from two orders whose difference is known."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.error_estimates.stated_error import stated_error
from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.plan import model_plan
from host_tools.forward.press_model import Loaded
from host_tools.scenes.scene import Scene, Waveguide

PLAN = model_plan(Scene(Inclusion(10.0, 6.0, 80.0)))
RAYS = Rays.over(Waveguide())
BUMP_MM = np.exp(-((RAYS.r_mm / 4.0) ** 2))


def face(force_n, peak_mm):
    return FaceState(1.0, peak_mm * BUMP_MM, BUMP_MM, 50.0 * peak_mm, force_n, force_n)


PRESSED = Loaded(face(0.200, 0.0200), other=face(0.202, 0.0201))  # 1 % in force, 0.5 % in the inclusion field
BASELINE = Loaded(face(0.19, 0.0), other=face(0.19, 0.0))


def test_in_small_strain_each_feature_states_twice_its_own_step():
    """What is left to gain is about as much as the last step gained, and as much again for safety: 2 %, and 1 %."""
    stated = stated_error(PLAN, RAYS, PRESSED, BASELINE)
    assert stated["force_n"] == pytest.approx(0.02)
    assert stated["max_deformation_mm"] == pytest.approx(0.01)
    assert stated["deformation_area_mm2"] == 0.0  # the same shape: rounding is no error


@pytest.mark.parametrize(
    ("plan", "factor"),
    [(replace(PLAN, strain="finite"), 2.0), (replace(PLAN, symmetry="half"), 0.4)],
)
def test_elsewhere_every_feature_states_the_largest_step(plan, factor):
    """1 %, that of the force: twice it where the other order is higher, 0.4 of it in 3-D, where it is lower."""
    stated = stated_error(plan, RAYS, PRESSED, BASELINE)
    assert stated["force_n"] == stated["max_deformation_mm"] == pytest.approx(factor * 0.01)


def test_what_was_prescribed_has_no_error():
    assert stated_error(PLAN, RAYS, PRESSED, BASELINE)["indentation_mm"] == 0.0


def test_without_another_order_nothing_is_stated():
    assert stated_error(PLAN, RAYS, PRESSED._replace(other=None), BASELINE) == {}
