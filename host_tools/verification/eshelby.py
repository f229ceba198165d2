"""Eshelby's sphere: in uniform far tension the strain inside an elastic sphere is uniform and known on paper.

Source: Eshelby, Proc. R. Soc. A 241:376 (1957).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from netgen.geom2d import SplineGeometry
from ngsolve import Mesh, ds, specialcf

from host_tools.forward.small_strain.elasticity import bulk_modulus_kpa, shear_modulus_kpa
from host_tools.forward.symmetry import AXISYMMETRIC
from host_tools.pages.benchmark import Benchmark, Chapter, at_most
from host_tools.verification.elastic import solve_elastic

FAR_RATIO = 60.0
"""Radius of the matrix over that of the sphere; its traction is felt to (1/60)^3."""
MATRIX_KPA, ORDER = 5.0, 5
INSIDE = ((0.3, 0.2), (0.6, 0.5), (0.1, 0.7))
"""Where the strain is read: (r, z) over the radius of the sphere."""


class StrainPair(NamedTuple):
    """Sphere and matrix."""

    sphere_kpa: float
    sphere_nu: float
    matrix_nu: float

    def __str__(self) -> str:
        return f"E_i = {self.sphere_kpa:g}, nu_i = {self.sphere_nu:g}, nu_m = {self.matrix_nu:g}"


PAIRS = (
    StrainPair(100, 0.49, 0.49),
    StrainPair(100, 0.3, 0.49),
    StrainPair(0.05, 0.3, 0.3),
    StrainPair(5000, 0.49, 0.49),
)


def exact_strain(pair: StrainPair) -> tuple[float, float]:
    """Return (e_rr, e_zz) in the sphere under a far stress sigma_zz of 1 kPa.

    e_v = e_v0 / (1 + al (K_i/K_m - 1)) and e_dev = e_dev0 / (1 + be (G_i/G_m - 1)).
    """
    nu = pair.matrix_nu
    K_i, K_m = bulk_modulus_kpa(pair.sphere_kpa, pair.sphere_nu), bulk_modulus_kpa(MATRIX_KPA, nu)
    G_i, G_m = shear_modulus_kpa(pair.sphere_kpa, pair.sphere_nu), shear_modulus_kpa(MATRIX_KPA, nu)
    al, be = (1 + nu) / (3 * (1 - nu)), 2 * (4 - 5 * nu) / (15 * (1 - nu))
    e_v = 1 / (3 * K_m) / (1 + al * (K_i / K_m - 1))
    e_dev = (2 / 3) / (2 * G_m) / (1 + be * (G_i / G_m - 1))
    return float(e_v / 3 - e_dev / 2), float(e_v / 3 + e_dev)


def largest_error(pair: StrainPair, order: int = ORDER) -> float:
    """Return the largest relative error of e_rr and e_zz at the points inside."""
    mesh = _mesh()
    E = mesh.MaterialCF({"sphere": pair.sphere_kpa, "matrix": MATRIX_KPA})
    nu = mesh.MaterialCF({"sphere": pair.sphere_nu, "matrix": pair.matrix_nu})

    def far_tension(v: Any) -> Any:
        return specialcf.normal(2)[1] * v[1] * AXISYMMETRIC.weight * ds("outer", bonus_intorder=2)

    held, zero = ("axis", "equator"), (0.0, 0.0)
    u = solve_elastic(mesh, AXISYMMETRIC, order, E, nu, held=held, boundary=zero, load=far_tension)
    rr, _, zz = AXISYMMETRIC.strain(u.components).normal
    exact_rr, exact_zz = exact_strain(pair)
    points = [mesh(*place) for place in INSIDE]
    return float(max(max(abs(rr(at) / exact_rr - 1), abs(zz(at) / exact_zz - 1)) for at in points))


def _mesh() -> Mesh:
    """A quarter of the meridian plane of a unit sphere in its matrix; z = 0 and r = 0 are planes of symmetry."""
    geometry = SplineGeometry()
    points = {}
    for name, r in (("inner", 1.0), ("outer", FAR_RATIO)):
        for place, at in (("east", (r, 0)), ("corner", (r, r)), ("north", (0, r))):
            points[name, place] = geometry.AppendPoint(*at)
    centre = geometry.AppendPoint(0, 0)

    def add(kind: str, ends: list[int], left: int, right: int, boundary: str, size: float) -> None:
        geometry.Append([kind, *ends], leftdomain=left, rightdomain=right, bc=boundary, maxh=size)

    for name, left, right, size in (("inner", 1, 2, 0.3), ("outer", 2, 0, FAR_RATIO / 3)):
        add("spline3", [points[name, at] for at in ("east", "corner", "north")], left, right, name, size)
    add("line", [centre, points["inner", "east"]], 1, 0, "equator", 0.3)
    add("line", [points["inner", "east"], points["outer", "east"]], 2, 0, "equator", FAR_RATIO / 3)
    add("line", [points["outer", "north"], points["inner", "north"]], 2, 0, "axis", FAR_RATIO / 3)
    add("line", [points["inner", "north"], centre], 1, 0, "axis", 0.3)
    geometry.SetMaterial(1, "sphere")
    geometry.SetMaterial(2, "matrix")
    mesh = Mesh(geometry.GenerateMesh(maxh=FAR_RATIO / 3, grading=0.25))
    mesh.Curve(ORDER + 1)
    return mesh


def benchmarks() -> tuple[Benchmark, ...]:
    """Return the errors for stiff, rigid, compressible and nearly empty spheres."""
    return tuple(at_most(str(pair), "largest relative error of strain", largest_error(pair), 1e-3) for pair in PAIRS)


def chapter(short: bool) -> Chapter:
    """Return the chapter; a short one is the same."""
    return Chapter(
        "Eshelby's sphere",
        f"Far tension on a sphere of modulus E_i in a matrix of {MATRIX_KPA:g} kPa, order {ORDER}: the strain inside "
        "is uniform, radial and axial strain are known.",
        "Eshelby, Proc. R. Soc. A 241:376 (1957).",
        benchmarks(),
    )
