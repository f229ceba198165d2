"""Forces balance and energy is conserved, in small strain and in finite strain."""

import pytest

from host_tools.verification import balance


@pytest.mark.parametrize("order", [2, 3])
def test_energy_pressure_and_both_reactions_agree(order):
    for benchmark in balance.linear_balance(order):
        assert benchmark.passed, benchmark


@pytest.mark.parametrize("contact", sorted(balance.WORK_BOUNDS))
def test_the_work_of_the_force_is_stored_in_finite_strain(contact):
    for benchmark in balance.finite_balance(contact):
        assert benchmark.passed, benchmark
