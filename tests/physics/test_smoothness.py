"""On the mesh of fixed topology features are smooth in size and depth; meshed anew, they are not."""

import numpy as np
import pytest

from host_tools.verification import smoothness


def test_the_fixed_topology_is_smooth_in_size_and_remeshing_is_not():
    found = {
        ("size_mm", kind): smoothness.noise(smoothness.scan("size_mm", kind, 8)) for kind in ("morphed", "remeshed")
    }
    assert np.abs(found["size_mm", "morphed"]).max() < 1e-6
    assert np.abs(found["size_mm", "remeshed"][:, 0]).max() > 1e-6


def test_the_map_folds_nowhere_in_the_box():
    assert smoothness.least_jacobian() > 0.05


@pytest.mark.long
def test_features_jump_by_less_than_a_thousandth_where_remeshing_takes_over():
    force, O1 = np.abs(smoothness.jump(smoothness.corners()[0]))[[3, 0]]
    assert max(force, O1) < 1e-3
