"""Three scalars of a contrast that are known on paper, and how errors and derivatives are carried along."""

import numpy as np
import pytest

from host_tools.cramer_rao.observation import SMOOTHING_MM, Observation, scalars_of, three_scalars
from host_tools.cramer_rao.rings import Rings

RINGS = Rings.within(9.9)
AMPLITUDE, WIDTH_MM = 0.2, 3.0
SPOT = AMPLITUDE * np.exp(-(RINGS.r_mm**2) / (2 * WIDTH_MM**2))
COUNT = len(RINGS.r_mm)


def test_a_gaussian_spot_has_the_scalars_of_its_formulas():
    centre, integral, area = three_scalars(SPOT, RINGS)
    blurred = 1 / (1 + SMOOTHING_MM**2 / WIDTH_MM**2)
    assert centre == pytest.approx(AMPLITUDE * blurred, rel=3e-3)
    assert integral == pytest.approx(
        2 * np.pi * AMPLITUDE * WIDTH_MM**2 * (1 - np.exp(-(9.9**2) / 2 / WIDTH_MM**2)), rel=3e-3
    )
    assert area == pytest.approx(np.pi * 2 * WIDTH_MM**2 * np.log(2 / blurred), rel=3e-3)


def test_a_dark_spot_has_the_area_of_a_bright_one():
    assert three_scalars(-SPOT, RINGS) == pytest.approx(three_scalars(SPOT, RINGS) * [-1, -1, 1])


def test_an_area_that_fills_the_window_is_left_out():
    even = Observation(np.full(COUNT, 0.2), {"gain": np.ones(COUNT)}, 1e-6 * np.eye(COUNT))
    assert three_scalars(even.values, RINGS)[2] == pytest.approx(np.pi * 9.9**2)
    found = scalars_of(even, 1, RINGS)
    assert found.values == pytest.approx([0.2, 0.2 * np.pi * 9.9**2])
    assert found.derivatives["gain"] == pytest.approx([1, np.pi * 9.9**2])
    assert (np.linalg.eigvalsh(found.covariance) > 0).all()


def test_a_factor_on_the_contrast_is_one_on_centre_and_integral_and_none_on_the_area():
    both = np.concatenate([SPOT, 2 * SPOT])
    found = scalars_of(Observation(both, {"factor": both}, np.eye(2 * COUNT)), 2, RINGS)
    assert found.derivatives["factor"] == pytest.approx(found.values * [1, 1, 0, 1, 1, 0], abs=1e-6)


def test_the_integral_of_white_noise_adds_up_over_the_rings():
    found = scalars_of(Observation(SPOT, {}, 1e-6 * np.eye(COUNT)), 1, RINGS)
    assert found.covariance[1, 1] == pytest.approx(1e-6 * (RINGS.area_mm2**2).sum())
