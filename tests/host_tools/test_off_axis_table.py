"""The committed table of lumps off the axis against a fresh solve in three dimensions, and its parts on paper."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.off_axis_table import contrast
from device.simulation.pressed_face import Placement, PressedFace
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve
from host_tools.off_axis_table import MODES, cosine_modes, off_axis_scene

FORCE_N = 0.02
"""Small strain: the solve's, and the table's smallest."""


@pytest.mark.parametrize(("truth", "offset_mm"), [((10.0, 5.0, 80.0), 1.5), ((7.0, 7.0, 100.0), 9.0)])
def test_the_face_off_the_axis_is_within_a_few_percent_of_the_lumps_peak(tables, truth, offset_mm):
    inclusion = Inclusion(*truth)
    scene = off_axis_scene(inclusion, offset_mm, force_n=FORCE_N)
    solution = solve(scene, replace(model_plan(scene), grading="coarse"))
    lump_mm = solution.pressed.w_mm - solution.baseline.w_mm
    x_mm, y_mm = (axis.reshape(1, -1).astype(np.float32) for axis in solution.rays.xy_mm)

    def w_mm(one, place):
        face = PressedFace(tables.centred.ramps(one), tables.off_axis, one, x_mm, y_mm)
        return face.at(FORCE_N, place)[0].reshape(lump_mm.shape)

    found_mm = w_mm(inclusion, Placement(x_mm=-offset_mm)) - w_mm(Inclusion(0.0, 5.0, 80.0), Placement())
    inside = solution.r_mm <= 9.9
    assert np.abs(found_mm - lump_mm)[:, inside].max() < 0.05 * lump_mm[:, inside].max()


def test_cosine_modes_of_a_cosine_series_are_its_coefficients():
    angle = 2 * np.pi * np.arange(48) / 48
    modes = cosine_modes((3 + 2 * np.cos(angle) - 0.5 * np.cos(4 * angle))[:, None])
    expected = np.zeros(MODES)
    expected[[0, 1, 4]] = 3, 2, -0.5
    np.testing.assert_allclose(modes[:, 0], expected, atol=1e-14)


def test_the_contrast_is_none_for_tissue_and_one_for_a_rigid_sphere():
    assert contrast(5.0) == 0.0
    assert contrast(1e9) == pytest.approx(1.0)
