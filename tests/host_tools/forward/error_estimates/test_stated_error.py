"""What a solution states of its error, from two orders whose difference is known."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.error_estimates.stated_error import stated_error
from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.plan import GRADED, model_plan
from host_tools.forward.press_model import Loaded
from host_tools.scenes.scene import Scene, Waveguide

PLAN = model_plan(Scene(Inclusion(10.0, 6.0, 80.0)))
RAYS = Rays.over(Waveguide())
BUMP_MM = np.exp(-((RAYS.r_mm / 4.0) ** 2))


def face(force_n, peak_mm):
    return FaceState(1.0, peak_mm * BUMP_MM, BUMP_MM, 50.0 * peak_mm, force_n, force_n)


CLOSED_KPA = np.where(RAYS.r_mm < RAYS.r_mm[0, -1], 1.0, 200.0)
"""A closed contact's pressure has no bound at the rim; the mean of these is 2."""
PRESSED = Loaded(face(0.200, 0.0200), other=face(0.202, 0.0201))  # 1 % in force, 0.5 % in the inclusion field
BASELINE = Loaded(face(0.19, 0.0), other=face(0.19, 0.0))


def test_in_small_strain_each_feature_states_three_times_its_own_step():
    """What is left to gain is about as much as the last step gained, and twice as much for safety: 3 %, and 1.5 %."""
    stated = stated_error(PLAN, RAYS, PRESSED, BASELINE)
    assert stated["force_n"] == pytest.approx(0.03)
    assert stated["max_deformation_mm"] == pytest.approx(0.015)
    assert stated["deformation_area_mm2"] == 0.0  # the same shape: rounding is no error


@pytest.mark.parametrize(
    ("plan", "factor"),
    [
        (replace(PLAN, strain="finite"), 3.0),
        (replace(PLAN, symmetry="half"), 0.4),
        (replace(PLAN, symmetry="half", grading=GRADED, order=4), 0.5),
        (replace(PLAN, symmetry="half", grading=GRADED, order=5), 2.0),
    ],
)
def test_elsewhere_every_feature_states_the_largest_step(plan, factor):
    """1 %, that of the force: three times it where the other order is higher, less at most orders in 3-D."""
    stated = stated_error(plan, RAYS, PRESSED, BASELINE)
    assert stated["force_n"] == stated["max_deformation_mm"] == pytest.approx(factor * 0.01)


@pytest.mark.parametrize(
    ("plan", "factor", "share"),
    [
        (replace(PLAN, formulation="mixed", grading=GRADED, order=3), 0.12, 0.25),
        (replace(PLAN, formulation="mixed", grading=GRADED, order=6), 1.5, 0.25),
        (replace(PLAN, contact="unilateral", grading=GRADED, order=4), 0.32, 0.25),
        (replace(PLAN, contact="unilateral", grading=GRADED, order=5), 0.75, 0.25),
        (replace(PLAN, symmetry="half", grading=GRADED, order=3), 0.3, 0.5),
    ],
)
def test_from_the_order_below_each_feature_states_a_share_of_its_own_step_or_of_a_part_of_the_largest(
    plan, factor, share
):
    pressed = Loaded(replace(PRESSED.state, p_kpa=CLOSED_KPA), other=face(0.202, 0.020001))
    stated = stated_error(plan, RAYS, pressed, BASELINE._replace(state=replace(BASELINE.state, p_kpa=CLOSED_KPA)))
    assert stated["force_n"] == pytest.approx(factor * 0.01)
    assert stated["max_deformation_mm"] == pytest.approx(factor * share * 0.01)
    assert (stated["indentation_mm"], stated["deformation_area_mm2"]) == (0.0, 0.0)


def test_in_finite_strain_under_a_force_orders_are_compared_at_that_force():
    """At a fixed indentation the indentation had no error at all."""
    finite = replace(PLAN, strain="finite")
    at_equal_mm = stated_error(finite, RAYS, PRESSED, BASELINE)
    under_force = stated_error(finite, RAYS, PRESSED, BASELINE, by_force=True)
    assert (at_equal_mm["indentation_mm"], under_force["force_n"]) == (0.0, 0.0)
    assert under_force["indentation_mm"] == pytest.approx(3 * 0.002 / 0.202)
    assert under_force["central_deformation_mm3"] == 2.5 * under_force["max_deformation_mm"]


@pytest.mark.parametrize(("rim_kpa", "times"), [(200.0, 0.75), (20.0, 4.0), (0.0, 4.0)])
def test_a_dome_that_all_but_lifts_off_states_the_largest_step_and_what_no_order_sees_at_its_edge(rim_kpa, times):
    """Orders 4 and 5 once agreed to 7e-5 where both were 1.7e-3 off."""
    domed = replace(PLAN, contact="unilateral", grading=GRADED, order=5)
    pressures_kpa = np.where(CLOSED_KPA > 1, rim_kpa, 1.0)
    near = Loaded(replace(PRESSED.state, p_kpa=pressures_kpa), other=face(0.200, 0.020001))
    base = BASELINE._replace(state=replace(BASELINE.state, p_kpa=CLOSED_KPA))
    least = 0.0 if rim_kpa == 200.0 else 2e-3
    assert stated_error(domed, RAYS, near, base)["max_deformation_mm"] == pytest.approx(max(times * 5e-5, least))
    far = near._replace(other=face(0.202, 0.020001))
    stated = stated_error(domed, RAYS, far, base)["max_deformation_mm"]
    assert stated == pytest.approx(times * (0.25 * 0.01 if rim_kpa == 200.0 else 0.01))
    open_without_it = stated_error(domed, RAYS, far._replace(state=replace(far.state, p_kpa=CLOSED_KPA)), BASELINE)
    assert open_without_it["max_deformation_mm"] == pytest.approx(4 * 0.01)


def test_what_was_prescribed_has_no_error():
    assert stated_error(PLAN, RAYS, PRESSED, BASELINE)["indentation_mm"] == 0.0


def test_without_another_order_nothing_is_stated():
    assert stated_error(PLAN, RAYS, PRESSED._replace(other=None), BASELINE) == {}
