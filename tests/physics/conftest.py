"""A small elastic solver on the project's own strain, stress and work, for problems with answers on paper."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from ngsolve import H1, BilinearForm, GridFunction, LinearForm

from host_tools.forward.elasticity import RING, section, strain, stress, work

Load = Callable[[Any, Any], Any]


@pytest.fixture
def solve_elastic() -> Callable[..., Any]:
    """Return a solver: mesh, order, moduli and Dirichlet data in, displacement (u_r, u_z) out."""

    def solve(
        mesh: Any, order: int, E: Any, nu: Any, *, held_r: str, held_z: str, boundary: Any, load: Load | None = None
    ) -> Any:
        space = H1(mesh, order=order, dirichlet=held_r) * H1(mesh, order=order, dirichlet=held_z)
        (u_r, u_z), (v_r, v_z) = space.TnT()
        a = BilinearForm(space, symmetric=True)
        a += work(stress(strain(u_r, u_z), E, nu), strain(v_r, v_z)) * RING * section(".*")
        a.Assemble()
        f = LinearForm(space)
        if load:
            f += load(v_r, v_z)
        f.Assemble()
        u = GridFunction(space)
        u.components[0].Set(boundary[0], definedon=mesh.Boundaries(held_r))
        u.components[1].Set(boundary[1], definedon=mesh.Boundaries(held_z))
        rest = f.vec.CreateVector()
        rest.data = f.vec - a.mat * u.vec
        u.vec.data += a.mat.Inverse(space.FreeDofs(), "sparsecholesky") * rest
        return u

    return solve
