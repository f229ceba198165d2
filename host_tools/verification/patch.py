"""The patch test: a uniform strain is reproduced to rounding, in a body and across the sliding contact.

Source: Hughes, The Finite Element Method (1987), section 4.6; across a contact: two springs in series.
"""

from __future__ import annotations

from itertools import product

from netgen.csg import unit_cube
from netgen.geom2d import unit_square
from ngsolve import CF, Integrate, Mesh, sqrt, x, y, z

from host_tools.forward.face_state import Rays
from host_tools.forward.materials import Elasticity
from host_tools.forward.meshes.sketch import OUTSIDE, Sketch
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import AXISYMMETRIC, SOLID, Expression
from host_tools.pages.benchmark import Benchmark, Chapter, at_most, relative
from host_tools.scenes.scene import Waveguide
from host_tools.verification.elastic import EVERYWHERE, solve_elastic

E_KPA = 5.0
ORDERS, POISSON_RATIOS = (1, 2, 3), (0.3, 0.49, 0.4999)
SPRINGS = Waveguide(4.0, (3.0,), (20.0,), poisson_ratio=0.0)
TISSUE_MM, TISSUE_KPA = 5.0, 8.0


def strain_error(symmetry_name: str, order: int, nu: float) -> float:
    """Return the L2 error of a displacement of uniform strain (about 0.03), held on the whole boundary."""
    exact: tuple[Expression, ...]
    if symmetry_name == "axisymmetric":
        mesh, symmetry = Mesh(unit_square.GenerateMesh(maxh=0.3)), AXISYMMETRIC
        exact = (0.02 * x, -0.03 * y)
    else:
        mesh, symmetry = Mesh(unit_cube.GenerateMesh(maxh=0.6)), SOLID
        exact = (0.02 * x + 0.01 * y, 0.01 * x - 0.01 * z, -0.03 * z)
    u = solve_elastic(mesh, symmetry, order, E_KPA, nu, held=[EVERYWHERE] * len(exact), boundary=exact)
    return float(sqrt(Integrate(sum((a - b) ** 2 for a, b in zip(u.components, exact, strict=True)), mesh)))


def translation_error(order: int) -> float:
    """Return the L2 error of a rigid translation along the axis, held at the base only: it costs nothing."""
    mesh = Mesh(unit_square.GenerateMesh(maxh=0.3))
    u = solve_elastic(mesh, AXISYMMETRIC, order, E_KPA, 0.49, held=("left", "bottom"), boundary=(0.0, 1.0))
    return float(sqrt(Integrate((CF(tuple(u.components)) - CF((0, 1))) ** 2, mesh)))


def springs_in_series() -> tuple[Benchmark, ...]:
    """Press two columns of equal width and no lateral contraction on each other: uniaxial, so two springs in series."""
    materials = Elasticity({"layer0": SPRINGS.layer_moduli_kpa[0], "tissue0": TISSUE_KPA}, dict.fromkeys(_PARTS, 0.0))
    press = LinearPress(_columns(), AXISYMMETRIC, 2)
    sampler = FaceSampler(press.mesh, Rays.over(SPRINGS), "axisymmetric")
    face = press.face_state(press.displacement(materials), materials, sampler)
    compliance = SPRINGS.layer_thicknesses_mm[0] / SPRINGS.layer_moduli_kpa[0]
    p_kpa = 1 / (compliance + TISSUE_MM / TISSUE_KPA)
    errors = {
        "w over the face": abs(face.w_mm / (p_kpa * compliance) - 1).max(),
        "p over the face": abs(face.p_kpa / p_kpa - 1).max(),
    }
    force_n = p_kpa * 3.141592653589793 * SPRINGS.radius_mm**2 / 1e3
    return (
        *(
            at_most("two columns in contact", f"largest relative error of {name}", e, 1e-8)
            for name, e in errors.items()
        ),
        relative("two columns in contact", "force (N)", face.force_n, force_n, 1e-8),
    )


_PARTS = ("layer0", "tissue0")


def _columns() -> Mesh:
    """Two columns of one radius, glued at the face."""
    a, height_mm = SPRINGS.radius_mm, SPRINGS.layer_thicknesses_mm[0]
    sketch = Sketch(1.0)
    centre, rim = sketch.point(0, 0), sketch.point(a, 0)
    top, top_rim, base, base_rim = (sketch.point(r, z) for z in (height_mm, -TISSUE_MM) for r in (0, a))
    sketch.line(centre, rim, left="layer0", right="tissue0", boundary="face")
    sketch.line(rim, top_rim, left="layer0", right=OUTSIDE, boundary="wall")
    sketch.line(top_rim, top, left="layer0", right=OUTSIDE, boundary="back")
    sketch.line(top, centre, left="layer0", right=OUTSIDE, boundary="axis")
    sketch.line(centre, base, left="tissue0", right=OUTSIDE, boundary="axis")
    sketch.line(base, base_rim, left="tissue0", right=OUTSIDE, boundary="base")
    sketch.line(base_rim, rim, left="tissue0", right=OUTSIDE, boundary="side")
    return Mesh(sketch.mesh(0.5))


def benchmarks() -> tuple[Benchmark, ...]:
    """Return the patch tests of every order, Poisson ratio and symmetry, and that of the contact."""
    cases = product(("axisymmetric", "solid"), ORDERS, POISSON_RATIOS)
    uniform = (
        at_most(f"{name}, p = {p}, nu = {nu}", "L2 error of u (mm)", strain_error(name, p, nu), 1e-13)
        for name, p, nu in cases
    )
    rigid = (at_most(f"translation, p = {p}", "L2 error of u (mm)", translation_error(p), 1e-12) for p in ORDERS)
    return (*uniform, *rigid, *springs_in_series())


def chapter(short: bool) -> Chapter:
    """Return the chapter; a short one is the same."""
    return Chapter(
        "Patch test",
        "A uniform strain of 3 % in a unit body, and a uniform pressure across the sliding contact, come out to "
        "rounding at every order and Poisson ratio.",
        "Hughes, The Finite Element Method (1987), section 4.6.",
        benchmarks(),
    )
