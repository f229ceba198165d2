"""The virtual probe's committed table against fresh finite-element force ramps in finite strain."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.scene import Scene
from host_tools.surface_table import BARE, RING_MM, fields, ramp, ring_means

TRUTHS = [(10.0, 5.0, 80.0), (3.7, 6.6, 104.0), (14.3, 11.2, 47.0)]
FORCES_N = np.array([0.05, 0.6])


@pytest.mark.parametrize("truth", TRUTHS)
def test_the_table_is_within_half_a_percent_of_the_lumps_deformation_and_one_of_its_pressure(table, truth):
    """What the lump adds, over its own peak in the central window: deformation 0.5 %, ring means of pressure 1 %."""
    lump_ramp = table.lump(Inclusion(*truth))
    inside = table.r_mm <= 9.9
    for force_n, solution in zip(FORCES_N, ramp(Scene(Inclusion(*truth)), FORCES_N), strict=True):
        fresh, found = fields(solution)[1], lump_ramp.at(force_n)
        for name, value, bound in (("w_mm", 0, 0.005), ("p_kpa", 1, 0.01)):
            error = np.abs(found[value] - fresh[value])[inside].max()
            assert error < bound * np.abs(fresh[value][inside]).max(), (name, force_n)


def test_the_lump_free_face_is_the_models(table):
    """At a force between the table's, on the same mesh: 0.1 % of the peak."""
    bare = table.ramps(Inclusion(0.0, 6.0, 80.0)).bare.at(0.3)
    fresh = fields(ramp(Scene(None), np.array([0.3]), BARE)[0])[0]
    for value in (0, 1):
        assert np.abs(bare[value] - fresh[value]).max() < 1e-3 * np.abs(fresh[value]).max()


def test_ring_means_keep_the_force_of_what_they_smooth():
    """A parabola p = 1 - r^2/121: its mean over a ring from a to b is 1 - (a^2 + b^2)/242."""
    r_mm = np.linspace(0, 11, 2201)
    mean = ring_means(r_mm, 1 - r_mm**2 / 121)
    inner, outer = np.maximum(r_mm - RING_MM / 2, 0), np.minimum(r_mm + RING_MM / 2, 11.0)
    np.testing.assert_allclose(mean, 1 - (inner**2 + outer**2) / 242, atol=1e-6)
