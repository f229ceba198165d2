"""The two spaces a scene is solved in: the half plane r > 0 of an axisymmetric scene, or the solid itself.

In axisymmetry x is r and y is z, the hoop strain u_r/r counts, and every integral carries 2 pi r. Displacement
components are ordered tangential first, normal to the face last.
Source: Hughes, The Finite Element Method (1987), section 2.12.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from ngsolve import CF, ds, dx, grad, pi, x

Expression = Any
"""An NGSolve coefficient function or a number."""


class Strain(NamedTuple):
    """Small strain: the normal components, and the tensor's shear components (not the engineering ones)."""

    normal: tuple[Expression, ...]
    shear: tuple[Expression, ...]

    @property
    def trace(self) -> Expression:
        """Volume change."""
        return sum(self.normal[1:], self.normal[0])


def axisymmetric_strain(u: tuple[Expression, ...]) -> Strain:
    """Return the strain of (u_r, u_z): rr, tt, zz and rz."""
    d_r, d_z = _gradients(u)
    return Strain((d_r[0], u[0] / x, d_z[1]), ((d_r[1] + d_z[0]) / 2,))


def solid_strain(u: tuple[Expression, ...]) -> Strain:
    """Return the strain of (u_x, u_y, u_z): xx, yy, zz and xy, yz, zx."""
    d_x, d_y, d_z = _gradients(u)
    shear = ((d_x[1] + d_y[0]) / 2, (d_y[2] + d_z[1]) / 2, (d_z[0] + d_x[2]) / 2)
    return Strain((d_x[0], d_y[1], d_z[2]), shear)


def _gradients(u: tuple[Expression, ...]) -> list[Expression]:
    """Return the gradient of every component; a component that is the number 0 has none."""
    return [CF((0.0,) * len(u)) if isinstance(component, float) else grad(component) for component in u]


@dataclass(frozen=True)
class Symmetry:
    """How displacements strain the body, what an integral weighs, and where each tangential component is held."""

    strain: Callable[[tuple[Expression, ...]], Strain]
    weight: Expression
    held: tuple[str, ...]
    """For each tangential component the boundary on which symmetry makes it vanish."""
    bonus_order: int

    def volume(self, materials: str) -> Any:
        """Return the measure over some materials, to follow an integrand times `weight`."""
        return dx(materials, bonus_intorder=self.bonus_order)

    @property
    def face(self) -> Any:
        """The measure over the sensing face."""
        return ds("face", bonus_intorder=self.bonus_order)


# A low quadrature order would put a point at r = 0, where u_r/r is 0/0: hence two orders more in axisymmetry.
AXISYMMETRIC = Symmetry(axisymmetric_strain, 2 * pi * x, ("axis",), bonus_order=2)
SOLID = Symmetry(solid_strain, 1.0, ("plane_x", "plane_y"), bonus_order=0)
