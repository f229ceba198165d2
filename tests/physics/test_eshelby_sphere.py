"""Eshelby's sphere: in uniform far tension the strain inside an elastic sphere is uniform and known on paper."""

import pytest

from host_tools.verification import eshelby


@pytest.mark.parametrize("pair", eshelby.PAIRS, ids=str)
def test_the_strain_inside_is_uniform_and_eshelbys(pair):
    assert eshelby.largest_error(pair) < 1e-3


def test_a_sphere_of_the_matrix_is_no_sphere():
    """E_i = E_m: uniaxial tension, e_zz = 1/E and e_rr = -nu/E."""
    e_rr, e_zz = eshelby.exact_strain(eshelby.StrainPair(eshelby.MATRIX_KPA, 0.3, 0.3))
    assert e_zz == pytest.approx(1 / eshelby.MATRIX_KPA)
    assert e_rr == pytest.approx(-0.3 / eshelby.MATRIX_KPA)
