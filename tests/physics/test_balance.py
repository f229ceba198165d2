"""Forces balance and energy is conserved, in small strain and in finite strain."""

import pytest

from host_tools.verification import balance


@pytest.mark.parametrize("order", [2, 3])
def test_energy_pressure_and_both_reactions_agree(order):
    found = balance.linear_balance(order)
    assert len(found) == 3
    for benchmark in found:
        assert benchmark.error <= 1e-8, benchmark


@pytest.mark.parametrize(("contact", "work_bound"), [("sliding_with_edge_force", 1e-4), ("sliding", 1e-3)])
def test_the_work_of_the_force_is_stored_in_finite_strain(contact, work_bound):
    """What holds the slip of the rim at its linear rate does work of second order: the force of the edge."""
    work, pressure, base = balance.finite_balance(contact)
    assert work.error <= work_bound, work
    for benchmark in (pressure, base):
        assert benchmark.error <= 1e-6, benchmark
