"""Eshelby's sphere: in uniform far tension the strain inside an elastic sphere is uniform and known on paper."""

import pytest
from netgen.geom2d import SplineGeometry
from ngsolve import Mesh, ds, specialcf

from host_tools.forward.elasticity import RING, strain

FAR = 60.0
E_MATRIX = 5.0


def _mesh():
    """Quarter disc of a unit sphere in a sphere 60 times as large; z = 0 and r = 0 are planes of symmetry."""
    geometry = SplineGeometry()
    points = {}
    for name, r in (("inner", 1.0), ("outer", FAR)):
        for place, at in (("east", (r, 0)), ("corner", (r, r)), ("north", (0, r))):
            points[name, place] = geometry.AppendPoint(*at)
    centre = geometry.AppendPoint(0, 0)
    arc = lambda name, left, right, size: geometry.Append(  # noqa: E731
        ["spline3", points[name, "east"], points[name, "corner"], points[name, "north"]],
        leftdomain=left, rightdomain=right, bc=name, maxh=size,
    )  # fmt: skip
    line = lambda a, b, domain, bc, size: geometry.Append(  # noqa: E731
        ["line", a, b], leftdomain=domain, rightdomain=0, bc=bc, maxh=size
    )
    arc("inner", 1, 2, 0.3)
    arc("outer", 2, 0, 20)
    line(centre, points["inner", "east"], 1, "equator", 0.3)
    line(points["inner", "east"], points["outer", "east"], 2, "equator", 20)
    line(points["outer", "north"], points["inner", "north"], 2, "axis", 20)
    line(points["inner", "north"], centre, 1, "axis", 0.3)
    geometry.SetMaterial(1, "sphere")
    geometry.SetMaterial(2, "matrix")
    mesh = Mesh(geometry.GenerateMesh(maxh=20, grading=0.25))
    mesh.Curve(6)
    return mesh


def _eshelby(E_i, nu_i, nu_m):
    """e_v = e_v0 / (1 + al (K_i/K_m - 1)), e_dev = e_dev0 / (1 + be (G_i/G_m - 1))

    Eshelby, Proc. R. Soc. A 241:376, 1957.
    """
    K, G = (lambda E, nu: E / (3 * (1 - 2 * nu))), (lambda E, nu: E / (2 * (1 + nu)))
    al, be = (1 + nu_m) / (3 * (1 - nu_m)), 2 * (4 - 5 * nu_m) / (15 * (1 - nu_m))
    e_v = 1 / (3 * K(E_MATRIX, nu_m)) / (1 + al * (K(E_i, nu_i) / K(E_MATRIX, nu_m) - 1))
    e_dev = (2 / 3) / (2 * G(E_MATRIX, nu_m)) / (1 + be * (G(E_i, nu_i) / G(E_MATRIX, nu_m) - 1))
    return e_v / 3 - e_dev / 2, e_v / 3 + e_dev


@pytest.mark.parametrize(("E_i", "nu_i", "nu_m"), [(100.0, 0.49, 0.49), (100.0, 0.3, 0.49), (0.05, 0.3, 0.3)])
def test_the_strain_inside_is_uniform_and_eshelbys(solve_elastic, E_i, nu_i, nu_m):
    mesh = _mesh()
    E, nu = mesh.MaterialCF({"sphere": E_i, "matrix": E_MATRIX}), mesh.MaterialCF({"sphere": nu_i, "matrix": nu_m})
    normal = specialcf.normal(2)
    u = solve_elastic(
        mesh, 5, E, nu, held_r="axis", held_z="equator", boundary=(0.0, 0.0),
        load=lambda v_r, v_z: normal[1] * v_z * RING * ds("outer", bonus_intorder=2),
    )  # fmt: skip
    inside = strain(*u.components)
    e_rr, e_zz = _eshelby(E_i, nu_i, nu_m)
    for point in (mesh(0.3, 0.2), mesh(0.6, 0.5), mesh(0.1, 0.7)):
        assert inside.rr(point) == pytest.approx(e_rr, rel=1e-3)
        assert inside.zz(point) == pytest.approx(e_zz, rel=1e-3)
