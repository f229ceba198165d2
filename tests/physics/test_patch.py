"""The patch test: a uniform strain is reproduced exactly on any mesh, at any order, at any Poisson ratio."""

import pytest
from netgen.geom2d import unit_square
from ngsolve import Integrate, Mesh, sqrt, x, y


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("nu", [0.3, 0.49, 0.499])
def test_a_uniform_strain_is_reproduced_exactly(solve_elastic, order, nu):
    """u = (0.02 r, -0.03 z) has constant strain and stress, so it is in equilibrium and in every space."""
    mesh = Mesh(unit_square.GenerateMesh(maxh=0.3))
    exact = 0.02 * x, -0.03 * y
    u = solve_elastic(mesh, order, 5.0, nu, held_r=".*", held_z=".*", boundary=exact)
    error = sqrt(Integrate((u.components[0] - exact[0]) ** 2 + (u.components[1] - exact[1]) ** 2, mesh))
    assert error < 1e-13


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_rigid_translation_has_no_stress(solve_elastic, order):
    """Moving everything by 1 along the axis costs nothing: u_z = 1, u_r = 0."""
    mesh = Mesh(unit_square.GenerateMesh(maxh=0.3))
    u = solve_elastic(mesh, order, 5.0, 0.49, held_r="left", held_z="bottom", boundary=(0.0, 1.0))
    assert Integrate(u.components[0] ** 2, mesh) < 1e-20
    assert Integrate((u.components[1] - 1.0) ** 2, mesh) < 1e-20
