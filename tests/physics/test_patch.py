"""The patch test: a uniform strain is reproduced exactly on any mesh, at any order, at any Poisson ratio."""

import pytest

from host_tools.verification import patch


@pytest.mark.parametrize("symmetry", ["axisymmetric", "solid"])
@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("nu", [0.3, 0.49, 0.4999])
def test_a_uniform_strain_is_reproduced_exactly(symmetry, order, nu):
    """u = (0.02 r, -0.03 z) has constant strain and stress, so it is in equilibrium and in every space."""
    assert patch.strain_error(symmetry, order, nu) < 1e-13


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_rigid_translation_has_no_stress(order):
    """Moving everything by 1 along the axis costs nothing: u_z = 1, u_r = 0."""
    assert patch.translation_error(order) < 1e-12


def test_the_sliding_contact_passes_a_uniform_pressure_on():
    """Two columns without lateral contraction are two springs in series."""
    found = patch.springs_in_series()
    assert len(found) == 3
    for benchmark in found:
        assert benchmark.error <= 1e-8, benchmark
