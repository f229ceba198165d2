"""Hayes' punch: a rigid flat cylinder on a bonded layer needs P = 2 E a delta kappa / (1 - nu2), kappa tabulated."""

import pytest

from host_tools.forward.solve import solve
from host_tools.scene import Press, Scene, Tissue, Waveguide

RIGID = Waveguide(layer_thicknesses_mm=(10.0,), layer_moduli_kpa=(1e6,), poisson_ratio=0.3)
A_MM, E_KPA = RIGID.radius_mm, 5.0


@pytest.mark.parametrize(
    ("nu", "radius_to_thickness", "kappa"),
    [(0.3, 0.4, 1.4727), (0.3, 1.0, 2.4839), (0.45, 1.0, 3.0919), (0.49, 0.4, 1.6640), (0.49, 1.0, 3.4846)],
)
def test_the_force_on_a_rigid_probe_is_hayes(nu, radius_to_thickness, kappa):
    """Hayes, Keer, Herrmann & Mockros, J. Biomech. 5:541, 1972; kappa by order 4, rims 0.001 a (0.1 %)."""
    tissue = Tissue(E_KPA, A_MM / radius_to_thickness, half_width_mm=300.0, poisson_ratio=nu)
    solution = solve(Scene(None, Press(indentation_mm=0.1), RIGID, tissue))
    expected_n = 2 * E_KPA * A_MM * 0.1 * kappa / (1 - nu**2) / 1e3
    assert solution.force_n == pytest.approx(expected_n, rel=5e-3)
