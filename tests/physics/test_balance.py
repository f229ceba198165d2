"""Forces balance and energy is conserved, in small strain and in finite strain."""

import numpy as np
import pytest

from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.verification import balance


@pytest.mark.parametrize("order", [2, 3])
def test_energy_pressure_and_both_reactions_agree(order):
    found = balance.linear_balance(order)
    assert len(found) == 3
    for benchmark in found:
        assert benchmark.error <= 1e-8, benchmark


def test_what_is_out_of_equilibrium_does_not_balance(monkeypatch):
    solved = LinearPress.displacement

    def shaken(press, materials):
        u = solved(press, materials)
        u.vec.FV().NumPy()[np.array(press.contact.space.FreeDofs())] *= 1.01
        return u

    monkeypatch.setattr(LinearPress, "displacement", shaken)
    assert not any(benchmark.passed for benchmark in balance.linear_balance())


@pytest.mark.parametrize(("contact", "work_bound"), [("sliding_with_edge_force", 1e-4), ("sliding", 1e-3)])
def test_the_work_of_the_force_is_stored_in_finite_strain(contact, work_bound):
    """What holds the slip of the rim at its linear rate does work of second order: the force of the edge."""
    work, pressure, base = balance.finite_balance(contact)
    assert work.error <= work_bound, work
    for benchmark in (pressure, base):
        assert benchmark.error <= 1e-6, benchmark
