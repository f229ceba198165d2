"""Rings around the axis: means on paper, pixels that see them, and harmonics of smooth errors."""

import numpy as np
import pytest

from host_tools.cramer_rao.rings import Rings, mean_between
from host_tools.scenes.probe_file import simulated_probe

R_MM = np.linspace(0.0, 11.0, 221)
RINGS = Rings.within(9.9)


def test_rings_end_with_the_window():
    assert RINGS.edges_mm[[0, -1]] == pytest.approx([0.0, 9.9])
    assert RINGS.area_mm2.sum() == pytest.approx(np.pi * 9.9**2)


def test_means_of_straight_profiles_are_exact():
    inner, outer = np.array([0.0, 2.03]), np.array([1.11, 7.77])
    expected = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2)
    assert mean_between(R_MM, R_MM, inner, outer) == pytest.approx(expected)
    assert RINGS.of_profile(R_MM, np.full((2, 221), 3.0)) == pytest.approx(np.full((2, len(RINGS.r_mm)), 3.0))


def test_a_map_has_the_means_of_its_profile():
    x_mm = (np.arange(400) + 0.5) * 0.06 - 12
    from_axis_mm = np.hypot(x_mm[None, :], x_mm[:, None])
    profile = np.exp(-(R_MM**2) / 20)
    of_map = RINGS.of_map(from_axis_mm, np.exp(-(from_axis_mm**2) / 20))
    assert of_map == pytest.approx(RINGS.of_profile(R_MM, profile), abs=2e-3)


def test_pixels_cover_what_the_picture_shows():
    inside = RINGS.edges_mm[1:] < 8.9  # beyond, the picture's upper and lower edges cut the rings
    pixel_mm2 = simulated_probe().scale.area_mm2
    assert RINGS.pixels[inside].sum() == pytest.approx(RINGS.area_mm2[inside].sum() / pixel_mm2, rel=2e-3)
    assert (RINGS.pixels[~inside] < RINGS.area_mm2[~inside] / pixel_mm2).all()


def test_all_harmonics_of_a_smooth_error_add_up_to_its_variance():
    """exp(-x) (I0 + 2 I1 + 2 I2 + ...) = 1 (Abramowitz & Stegun 9.6.34)."""
    total = sum(RINGS.coupling(2.0, m).diagonal() for m in range(60))
    assert total == pytest.approx(np.ones(len(RINGS.r_mm)))


def test_smooth_errors_couple_neighbours_and_are_a_covariance():
    coupling = RINGS.coupling(3.0)
    assert coupling[0, 0] == pytest.approx(1.0, abs=0.01)
    assert np.linalg.eigvalsh(coupling).min() > -1e-12
    correlation = coupling / np.sqrt(np.outer(coupling.diagonal(), coupling.diagonal()))
    assert correlation[10, 11] > 0.99
    assert correlation[0, 30] < 0.05
