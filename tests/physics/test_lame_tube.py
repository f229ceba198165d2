"""Lame's thick-walled tube (plane strain), u_r = A r + B / r: at order p the error falls as h^(p+1)."""

import numpy as np
import pytest
from netgen.geom2d import SplineGeometry
from ngsolve import Integrate, Mesh, ds, sqrt, x

from host_tools.forward.elasticity import RING

INNER, OUTER, PRESSURE, E, NU = 1.0, 2.0, 3.0, 5.0, 0.3


def _exact():
    """Timoshenko & Goodier, section 28: A = (1+nu)(1-2nu) p a2 / (E (b2-a2)), B = (1+nu) p a2 b2 / (E (b2-a2))."""
    a2, b2 = INNER**2, OUTER**2
    scale = (1 + NU) * PRESSURE * a2 / (E * (b2 - a2))
    return scale * (1 - 2 * NU) * x + scale * b2 / x


def _error(solve_elastic, order, size):
    geometry = SplineGeometry()
    geometry.AddRectangle((INNER, 0), (OUTER, 1), bcs=["bottom", "outer", "top", "inner"])
    mesh = Mesh(geometry.GenerateMesh(maxh=10))
    for _ in range(size):
        mesh.Refine()
    u = solve_elastic(
        mesh, order, E, NU, held_r="none", held_z="bottom|top", boundary=(0.0, 0.0),
        load=lambda v_r, v_z: PRESSURE * v_r * RING * ds("inner"),
    )  # fmt: skip
    return float(sqrt(Integrate((u.components[0] - _exact()) ** 2, mesh)))


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_the_error_falls_with_the_rate_of_the_order(solve_elastic, order):
    errors = [_error(solve_elastic, order, size) for size in (1, 2, 3)]
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert rates[-1] == pytest.approx(order + 1, abs=0.25)


def test_the_displacement_is_lames(solve_elastic):
    assert _error(solve_elastic, 4, 3) < 1e-6
