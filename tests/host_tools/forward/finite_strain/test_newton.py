"""Newton's method on energies of one number, u on the unit square, whose minima are known."""

from math import log, nan

import pytest
from netgen.geom2d import unit_square
from ngsolve import BilinearForm, GridFunction, Mesh, NumberSpace, Variation, dx
from ngsolve import log as log_cf

from host_tools.forward.finite_strain.newton import EnergyNewton, NewtonStatus

MESH = Mesh(unit_square.GenerateMesh(maxh=1))


def _newton(energy_of, start):
    """Return the method for an energy E(u), at a start where E'' > 0."""
    space = NumberSpace(MESH)
    energy = BilinearForm(space, symmetric=True)
    energy += Variation(energy_of(space.TrialFunction()) * dx)
    u = GridFunction(space)
    u.vec[:] = start
    return EnergyNewton(energy, u, space.FreeDofs())


def test_a_quadratic_energy_takes_one_step_and_one_to_see_it():
    newton = _newton(lambda u: (u - 3) ** 2 + 1, start=0.0)
    descent = newton.descend()
    assert (descent.status, descent.iterations) == (NewtonStatus.CONVERGED, 2)
    assert newton.u.vec[0] == pytest.approx(3, abs=1e-12)


def test_a_minimum_beside_a_barrier_is_found():
    """u - log(u) has its minimum 1 at u = 1 and is no number below 0, where a full step from 4 would land."""
    newton = _newton(lambda u: u - log_cf(u), start=4.0)
    assert newton.descend().status is NewtonStatus.CONVERGED
    assert newton.u.vec[0] == pytest.approx(1, abs=1e-7)


def test_it_leaves_a_hilltop_downwards():
    """Near 0 the double well (u^2 - 1)^2 curves down, and Newton's own step would climb to its top."""
    newton = _newton(lambda u: (u**2 - 1) ** 2 + 1, start=2.0)
    newton.u.vec[:] = 0.1
    assert newton.descend().status is NewtonStatus.CONVERGED
    assert newton.u.vec[0] == pytest.approx(1, abs=1e-7)


@pytest.mark.parametrize("start", [-1.0, nan])
def test_a_start_without_energy_is_folded_and_is_not_moved(start):
    newton = _newton(lambda u: u - log_cf(u), start=4.0)
    newton.u.vec[:] = start
    descent = newton.descend()
    assert (descent.status, descent.iterations) == (NewtonStatus.FOLDED, 0)
    assert newton.u.vec[0] == pytest.approx(start, nan_ok=True)


def test_iterations_that_run_out_are_reported_and_have_gone_down():
    newton = _newton(lambda u: u - log_cf(u), start=0.01)
    assert newton.descend(max_iterations=2).status is NewtonStatus.UNFINISHED
    u = newton.u.vec[0]
    assert u - log(u) < 0.01 - log(0.01)


def test_an_energy_without_a_minimum_is_never_converged():
    newton = _newton(lambda u: u + 1e-3 * u**2 * (u + 1), start=1.0)
    newton.u.vec[:] = -1e3
    assert newton.descend().status is not NewtonStatus.CONVERGED
