"""What passes the face: exact for a beam, softened at the critical angle for a wide source."""

import math

import numpy as np
import pytest

from device.simulation.physics.lookup_optics import (
    COSINES,
    WIDEST,
    WIDTHS,
    diffuse_reflectance,
    passing,
    passing_index,
    transmission,
)

CRITICAL = math.sqrt(1 - 1 / 1.41**2)
DRY = passing(1.41, 1.0)


def passed(cosine, width):
    return DRY[passing_index(np.float32(cosine), np.float32(width))]


def test_a_narrow_beam_passes_as_fresnel_says():
    assert passed(0.9, 0.0) == pytest.approx(0.9 * transmission(np.array([0.9]), 1.41, 1.0)[0], rel=1e-3)


def test_a_narrow_beam_beyond_the_critical_angle_does_not_pass():
    assert passed(CRITICAL - 0.01, 0.0) == 0.0


def test_a_wide_source_leaks_on_both_sides_of_the_critical_angle():
    assert 0.0 < passed(CRITICAL - 0.02, 0.1) < passed(CRITICAL + 0.02, 0.1) < passed(CRITICAL + 0.02, 0.0)


def test_light_from_behind_does_not_pass():
    assert passed(-0.1, 0.0) == 0.0


def test_angles_and_widths_outside_the_table_count_as_its_last():
    assert passing_index(np.float32(1.01), np.float32(9 * WIDEST)) == COSINES * WIDTHS - 1


def test_diffuse_light_is_sent_back_by_the_textbook_share():
    # 9.2 % into n = 1.5: Egan & Hilgeman, Optical Properties of Inhomogeneous Materials, 1979, table for n = 1.5.
    assert diffuse_reflectance(1.0, 1.5) == pytest.approx(0.092, abs=0.001)
    assert diffuse_reflectance(1.4, 1.4) == pytest.approx(0.0, abs=1e-12)
