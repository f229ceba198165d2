"""Isotropic linear elasticity: strain to stress and work, with displacements alone or with a pressure.

Near the incompressible limit displacements alone lock; then the mean stress is an unknown of its own,
discontinuous between elements. Source: Hughes, The Finite Element Method (1987), sections 2.7 and 4.3.
"""

from __future__ import annotations

from typing import NamedTuple

from host_tools.forward.symmetry import Expression, Strain


class Stress(NamedTuple):
    """Cauchy stress in kPa: normal and shear components, ordered as those of the strain."""

    normal: tuple[Expression, ...]
    shear: tuple[Expression, ...]


def shear_modulus_kpa(youngs_modulus_kpa: Expression, poisson_ratio: Expression) -> Expression:
    """Return mu = E / 2(1 + nu)."""
    return youngs_modulus_kpa / (2 * (1 + poisson_ratio))


def lame_modulus_kpa(youngs_modulus_kpa: Expression, poisson_ratio: Expression) -> Expression:
    """Return lambda = E nu / (1 + nu)(1 - 2 nu)."""
    return youngs_modulus_kpa * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio))


def bulk_modulus_kpa(youngs_modulus_kpa: Expression, poisson_ratio: Expression) -> Expression:
    """Return K = E / 3(1 - 2 nu)."""
    return youngs_modulus_kpa / (3 * (1 - 2 * poisson_ratio))


def stress(e: Strain, mu_kpa: Expression, mean_kpa: Expression) -> Stress:
    """Return Hooke's stress 2 mu e + mean I; the mean is lambda tr(e), or the pressure unknown of a mixed space."""
    return Stress(tuple(2 * mu_kpa * n + mean_kpa for n in e.normal), tuple(2 * mu_kpa * s for s in e.shear))


def work(s: Stress, e: Strain) -> Expression:
    """Return sigma : e, the work density of a stress on a strain."""
    normal = sum(a * b for a, b in zip(s.normal, e.normal, strict=True))
    return normal + 2 * sum(a * b for a, b in zip(s.shear, e.shear, strict=True))
