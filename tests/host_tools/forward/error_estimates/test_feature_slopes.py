"""Slopes of O1-O3 are their derivatives: a small change of the field moves each as they say."""

from dataclasses import asdict

import numpy as np
import pytest

from host_tools.forward.deformation import deformation
from host_tools.forward.error_estimates.feature_slopes import feature_slopes
from host_tools.forward.face_state import Rays
from host_tools.scenes.scene import Waveguide

R_MM = Rays.over(Waveguide()).r_mm[0]
RING_MM = np.exp(-(((R_MM - 4.0) / 2.0) ** 2))  # a peak beside the middle: its area has two edges
CHANGE_MM = 1e-6 * np.cos(R_MM / 3.0)
TOTAL_MM3, MORE_MM3 = 40.0, 1e-4


def test_each_feature_moves_as_its_slope_says():
    before, after = (
        asdict(deformation(R_MM, RING_MM + change, TOTAL_MM3 + more))
        for change, more in ((0.0, 0.0), (CHANGE_MM, MORE_MM3))
    )
    for name, slope in feature_slopes(R_MM, RING_MM).items():
        foretold = slope.per_sample @ CHANGE_MM + slope.per_total * MORE_MM3
        assert foretold == pytest.approx(after[name] - before[name], rel=1e-3), name


def test_a_field_without_a_peak_has_no_area_that_could_move():
    assert not feature_slopes(R_MM, -RING_MM)["deformation_area_mm2"].per_sample.any()
