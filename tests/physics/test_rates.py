"""Lame's thick-walled tube (plane strain): at order p the error falls as h^(p+1), that of the strain as h^p."""

import pytest

from host_tools.verification import rates

ORDERS = (1, 2, 3, 4)


def test_every_order_has_its_full_rate_and_the_displacement_is_lames():
    *found, last = rates.benchmarks(rates.measurements())
    known = [rate for order in ORDERS for rate in (order + 1, order)]
    assert [benchmark.measured for benchmark in found] == pytest.approx(known, abs=0.25)
    assert last.error <= 1e-6


def test_the_exact_tube_carries_the_pressure_inside_and_none_outside():
    """sigma_rr = 2 mu e_rr + lambda (e_rr + e_tt) with u = A r + B / r: -p at the inner radius, 0 at the outer."""
    A, B = rates.exact_coefficients()
    mu = rates.E_KPA / (2 * (1 + rates.NU))
    lam = rates.E_KPA * rates.NU / ((1 + rates.NU) * (1 - 2 * rates.NU))
    for r, known in ((rates.INNER_MM, -rates.PRESSURE_KPA), (rates.OUTER_MM, 0.0)):
        assert 2 * mu * (A - B / r**2) + lam * 2 * A == pytest.approx(known, abs=1e-12)
