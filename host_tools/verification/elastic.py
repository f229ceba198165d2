"""A small elastic solver on the project's own strain, stress and work, for problems with answers on paper."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from ngsolve import H1, BilinearForm, GridFunction, LinearForm

from host_tools.forward.small_strain.elasticity import lame_modulus_kpa, shear_modulus_kpa, stress, work
from host_tools.forward.symmetry import Expression, Symmetry

Load = Callable[[Sequence[Expression]], Any]
"""From the test functions to the integral of a load's work."""
EVERYWHERE = ".*"


def solve_elastic(
    mesh: Any,
    symmetry: Symmetry,
    order: int,
    E_kpa: Expression,
    nu: Expression,
    *,
    held: Sequence[str],
    boundary: Sequence[Expression],
    load: Load | None = None,
) -> Any:
    """Return the displacement (mm): component i takes the value `boundary[i]` on the boundaries `held[i]`."""
    space = H1(mesh, order=order, dirichlet=held[0])
    for boundaries in held[1:]:
        space = space * H1(mesh, order=order, dirichlet=boundaries)
    trial, test = space.TnT()
    e, mu = symmetry.strain(trial), shear_modulus_kpa(E_kpa, nu)
    a = BilinearForm(space, symmetric=True)
    s = stress(e, mu, lame_modulus_kpa(E_kpa, nu) * e.trace)
    a += work(s, symmetry.strain(test)) * symmetry.weight * symmetry.volume(EVERYWHERE)
    a.Assemble()
    f = LinearForm(space)
    if load:
        f += load(test)
    f.Assemble()
    u = GridFunction(space)
    for component, value, boundaries in zip(u.components, boundary, held, strict=True):
        component.Set(value, definedon=mesh.Boundaries(boundaries))
    rest = f.vec.CreateVector()
    rest.data = f.vec - a.mat * u.vec
    u.vec.data += a.mat.Inverse(space.FreeDofs(), "sparsecholesky") * rest
    return u
