"""The virtual probe's committed table against fresh finite-element solves."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.solve import solve
from host_tools.scene import Press, Scene

TRUTHS = [(10.0, 5.0, 80.0), (3.7, 6.6, 104.0), (14.3, 11.2, 47.0), (6.1, 4.3, 61.0), (1.9, 9.7, 93.0)]


@pytest.mark.parametrize("truth", TRUTHS)
def test_the_table_is_within_half_a_percent_of_the_peak(table, truth):
    inclusion = Inclusion(*truth)
    fresh = solve(Scene(inclusion, Press(force_n=1.0)))
    inside = fresh.r_mm <= 0.9 * fresh.r_mm[-1]
    error = np.abs(table.lump(inclusion) - fresh.lump_deformation_mm)[inside].max()
    assert error < 0.005 * fresh.lump.max_deformation_mm


def test_the_lump_free_surface_is_the_models(table):
    bare = solve(Scene(None, Press(force_n=1.0)))
    np.testing.assert_allclose(table.w_mm_per_n[:-1], bare.w_mm[:-1], rtol=1e-4)
