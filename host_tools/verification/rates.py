"""Convergence: the full rate of every order where the solution is smooth (Lame's tube).

Source: Timoshenko & Goodier, Theory of Elasticity, section 28; Ciarlet, The Finite Element Method (1978), section 3.2.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from netgen.geom2d import SplineGeometry
from ngsolve import Integrate, Mesh, ds, sqrt, x

from host_tools.forward.small_strain.elasticity import lame_modulus_kpa, shear_modulus_kpa, stress, work
from host_tools.forward.symmetry import AXISYMMETRIC, Expression, Strain
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, absolute, at_most
from host_tools.verification.elastic import EVERYWHERE, solve_elastic

INNER_MM, OUTER_MM, PRESSURE_KPA, E_KPA, NU = 1.0, 2.0, 3.0, 5.0, 0.3
ORDERS, LEVELS = (1, 2, 3, 4), (1, 2, 3)
RATE_BOUND = 0.25


class TubeErrors(NamedTuple):
    """Errors of one solution: of u in L2 (mm) and of the strain in the energy norm."""

    displacement: float
    energy: float


def exact_coefficients() -> tuple[float, float]:
    """Return A and B of u_r = A r + B / r for a tube in plane strain under inner pressure."""
    a2, b2 = INNER_MM**2, OUTER_MM**2
    scale = (1 + NU) * PRESSURE_KPA * a2 / (E_KPA * (b2 - a2))
    return scale * (1 - 2 * NU), scale * b2


def tube_errors(order: int, refinements: int) -> TubeErrors:
    """Return the errors on a mesh refined uniformly so many times."""
    mesh = _mesh(refinements)

    def inner_pressure(v: Any) -> Any:
        return PRESSURE_KPA * v[0] * AXISYMMETRIC.weight * ds("inner")

    held, zero = ("none", "bottom|top"), (0.0, 0.0)
    u = solve_elastic(mesh, AXISYMMETRIC, order, E_KPA, NU, held=held, boundary=zero, load=inner_pressure)
    A, B = exact_coefficients()
    found = AXISYMMETRIC.strain(u.components)
    exact = (A - B / x**2, A + B / x**2, 0.0)
    off = Strain(tuple(e - known for e, known in zip(found.normal, exact, strict=True)), found.shear)
    energy = Integrate(_energy_density(off) * AXISYMMETRIC.weight * AXISYMMETRIC.volume(EVERYWHERE), mesh)
    return TubeErrors(float(sqrt(Integrate((u.components[0] - (A * x + B / x)) ** 2, mesh))), float(sqrt(energy)))


def _energy_density(e: Strain) -> Expression:
    return work(stress(e, shear_modulus_kpa(E_KPA, NU), lame_modulus_kpa(E_KPA, NU) * e.trace), e)


def _mesh(refinements: int) -> Mesh:
    geometry = SplineGeometry()
    geometry.AddRectangle((INNER_MM, 0), (OUTER_MM, 1), bcs=["bottom", "outer", "top", "inner"])
    mesh = Mesh(geometry.GenerateMesh(maxh=10))
    for _ in range(refinements):
        mesh.Refine()
    return mesh


def measurements() -> dict[int, list[TubeErrors]]:
    """Return the errors by order, one a level of refinement."""
    return {order: [tube_errors(order, level) for level in LEVELS] for order in ORDERS}


def benchmarks(found: dict[int, list[TubeErrors]]) -> tuple[Benchmark, ...]:
    """Return the rates of the last halving: p + 1 of the displacement, p of the energy; and the last error."""
    rates = []
    for order, errors in found.items():
        u_rate, energy_rate = np.log2(np.divide(errors[-2], errors[-1]))
        rates += [
            absolute(f"p = {order}", "rate of u in L2", float(u_rate), order + 1, RATE_BOUND),
            absolute(f"p = {order}", "rate in the energy norm", float(energy_rate), order, RATE_BOUND),
        ]
    last = found[ORDERS[-1]][-1].displacement
    return (*rates, at_most(f"p = {ORDERS[-1]}, finest", "L2 error of u (mm)", last, 1e-6))


def _figure(found: dict[int, list[TubeErrors]]) -> Figure:
    def draw(figure: Any) -> None:
        for panel, name, axes in zip((0, 1), TubeErrors._fields, figure.subplots(1, 2), strict=True):
            for order, errors in found.items():
                axes.semilogy(LEVELS, [error[panel] for error in errors], "o-", label=f"p = {order}")
            axes.set_xticks(LEVELS)
            axes.set_xlabel("halvings of the elements")
            axes.set_ylabel(f"error, {name}")
            axes.grid(alpha=0.3)
        axes.legend()

    return Figure("verification_rates.svg", "Lamé's tube: error against halvings of the elements, order by order", draw)


def chapter(short: bool) -> Chapter:
    """Return the chapter; a short one is the same."""
    found = measurements()
    return Chapter(
        "Rates of convergence, smooth solution (Lamé's tube)",
        "A thick tube under inner pressure has no singularity: halving the elements divides the error of the "
        "displacement by 2^(p+1) and that of the strain by 2^p.",
        "Timoshenko & Goodier, Theory of Elasticity, section 28.",
        benchmarks(found),
        figures=(_figure(found),),
    )
