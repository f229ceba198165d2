"""What a solution says of itself, on faces whose pressure is known."""

from dataclasses import replace

import numpy as np
import pytest

from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.plan import model_plan
from host_tools.forward.solution import Solution
from host_tools.scenes.scene import Scene

RAYS = Rays.over(Scene().waveguide)


def _under(p_kpa, **plan):
    face = FaceState(1.0, np.zeros_like(p_kpa), p_kpa, 0.0, 1.0, 1.0)
    return Solution(RAYS, face, face, replace(model_plan(Scene()), **plan), 1, {}, Scene())


def test_pressure_that_rings_inside_an_element_is_no_tension():
    """1 kPa with a wave of 2 kPa and 0.5 mm: negative at points, positive on every ring."""
    assert _under(1 + 2 * np.sin(2 * np.pi * RAYS.r_mm / 0.5)).pressure_is_positive


def test_a_face_that_has_grown_by_a_tenth_carries_its_force_on_more_area():
    p_kpa = 2 - RAYS.r_mm / 11
    face = FaceState(1.0, np.zeros_like(p_kpa), p_kpa, 0.0, 1.0, 1.0, outward_mm=0.1 * RAYS.r_mm)
    np.testing.assert_allclose(face.deformed_p_kpa(RAYS), p_kpa / 1.21, rtol=1e-12)
    np.testing.assert_array_equal(replace(face, outward_mm=None).deformed_p_kpa(RAYS), p_kpa)  # small strain


@pytest.mark.parametrize("middle_mm", [0.0, 4.0, 9.0])
def test_a_ring_that_is_pulled_is_found(middle_mm):
    pulled = np.where(np.abs(RAYS.r_mm - middle_mm) < 1.5, -0.1, 1.0)
    assert not _under(pulled).pressure_is_positive
    assert _under(pulled, contact="unilateral").pressure_is_positive  # it cannot pull
