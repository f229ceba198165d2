"""O1-O3 of profiles whose peak, integral and area are known on paper."""

import numpy as np
import pytest

from host_tools.forward.deformation import area_above, deformation

R = np.linspace(0.0, 11.0, 2201)


def test_a_cone_has_the_known_numbers():
    """w = 1 - r/5: peak 1; integral pi 5^2 / 3; above one half inside r = 2.5."""
    cone = np.maximum(1 - R / 5, 0.0)
    found = deformation(R, cone, 7.0)
    assert found.max_deformation_mm == 1.0
    assert found.central_deformation_mm3 == pytest.approx(np.pi * 25 / 3, rel=1e-4)
    assert found.deformation_area_mm2 == pytest.approx(np.pi * 2.5**2, rel=1e-9)
    assert found.total_deformation_mm3 == 7.0


def test_the_rim_is_left_out_of_the_window():
    """A field that rises only beyond 9.9 mm has no peak, integral or area in the window."""
    rim = np.where(R > 9.95, 5.0, 0.0)
    found = deformation(R, rim, 0.0)
    assert (found.max_deformation_mm, found.central_deformation_mm3, found.deformation_area_mm2) == (0.0, 0.0, 0.0)


def test_a_ring_has_the_area_of_a_ring():
    """A trapezoid between 2 and 6 mm, above one half from 2.5 to 5.5 mm: pi (5.5^2 - 2.5^2)."""
    ring = np.interp(R, [2.0, 3.0, 5.0, 6.0], [0.0, 1.0, 1.0, 0.0])
    assert area_above(R, ring, 0.5) == pytest.approx(np.pi * (5.5**2 - 2.5**2), rel=1e-6)
