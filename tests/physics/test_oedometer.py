"""A confined stack under a plate: uniform uniaxial strain in each layer, nominal stress P(l) = dW/dl known on paper.

W(l) = mu/2 (l^-2/3 (2 + l^2) - 3) + K/2 (l - 1)^2 at F = diag(1, 1, l), and P is the same in every layer.
"""

import numpy as np
import pytest
from netgen.geom2d import SplineGeometry
from ngsolve import Mesh
from scipy.optimize import brentq

from host_tools.forward.face_state import Rays
from host_tools.forward.finite_strain.equilibrium_path import EquilibriumPath, PathEnded
from host_tools.forward.finite_strain.load_path import press_along, press_to_forces
from host_tools.forward.finite_strain.sliding import SlidingContact
from host_tools.forward.materials import Elasticity
from host_tools.scenes.scene import Waveguide

RADIUS, PROBE_MM, TISSUE_MM, NU = 4.0, 3.0, 5.0, 0.4
E_PROBE, E_TISSUE = 30.0, 10.0
MATERIALS = Elasticity({"layer0": E_PROBE, "tissue0": E_TISSUE}, {"layer0": NU, "tissue0": NU})
RAYS = Rays.over(Waveguide(radius_mm=RADIUS))


def _stack():
    """Probe over tissue, both as wide as each other; the confining side is held as the axis is, radially."""
    geometry = SplineGeometry()
    heights = (-TISSUE_MM, 0.0, PROBE_MM)
    inner = [geometry.AppendPoint(0, z) for z in heights]
    outer = [geometry.AppendPoint(RADIUS, z) for z in heights]
    for i, name in enumerate(("base", "face", "back")):
        geometry.Append(["line", inner[i], outer[i]], leftdomain=(1, 2, 0)[i], rightdomain=(0, 1, 2)[i], bc=name)
    for i, body in ((0, 1), (1, 2)):
        geometry.Append(["line", outer[i], outer[i + 1]], leftdomain=body, rightdomain=0, bc="axis")
        geometry.Append(["line", inner[i + 1], inner[i]], leftdomain=body, rightdomain=0, bc="axis")
    geometry.SetMaterial(1, "tissue0")
    geometry.SetMaterial(2, "layer0")
    return Mesh(geometry.GenerateMesh(maxh=2))


def _stress_kpa(stretch, E):
    mu, K = E / 2 / (1 + NU), E / 3 / (1 - 2 * NU)
    return mu * (2 / 3) * (stretch ** (1 / 3) - stretch ** (-5 / 3)) + K * (stretch - 1)


def _probe_stretch(indentation_mm):
    def imbalance(stretch):
        tissue = 1 - (indentation_mm - (1 - stretch) * PROBE_MM) / TISSUE_MM
        return _stress_kpa(stretch, E_PROBE) - _stress_kpa(tissue, E_TISSUE)

    least = max(1e-9, 1 - indentation_mm / PROBE_MM)  # all the indentation in the probe, or next to all of it
    most = min(1.0, 1 - (indentation_mm - TISSUE_MM) / PROBE_MM) - 1e-9  # none of it, or the tissue squeezed out
    return brentq(imbalance, least, most, xtol=1e-14)


def test_a_confined_stack_is_pressed_as_on_paper():
    loads = (0.5, 1.5, 2.5)
    for loaded in press_along(_stack(), MATERIALS, loads, order=2, rays=RAYS):
        stretch = _probe_stretch(loaded.face.indentation_mm)
        pressure = -_stress_kpa(stretch, E_PROBE)
        assert loaded.face.p_kpa == pytest.approx(np.full_like(loaded.face.p_kpa, pressure), rel=1e-6)
        assert loaded.face.w_mm == pytest.approx(np.full_like(loaded.face.w_mm, (1 - stretch) * PROBE_MM), rel=1e-6)
        assert loaded.face.force_n == pytest.approx(pressure * np.pi * RADIUS**2 / 1e3, rel=1e-9)
        assert loaded.face.total_mm3 == pytest.approx((1 - stretch) * PROBE_MM * np.pi * RADIUS**2, rel=1e-6)
        assert np.abs(loaded.slip_mm).max() < 1e-8


def test_a_stack_pressed_beyond_its_height_stays_in_equilibrium_where_it_got_to():
    path = EquilibriumPath(SlidingContact(_stack(), MATERIALS, 2))
    with pytest.raises(PathEnded, match="indentation_mm is 20, but the press could be followed only to") as failure:
        path.press_to(20.0)
    assert 3 < failure.value.reached_mm == path.indentation_mm < PROBE_MM + TISSUE_MM
    assert failure.value.reached_n == path.force_n
    pressure = -_stress_kpa(_probe_stretch(path.indentation_mm), E_PROBE)
    assert path.force_n == pytest.approx(pressure * np.pi * RADIUS**2 / 1e3, rel=1e-6)


def test_a_force_out_of_reach_is_refused_with_the_largest_one_reached():
    with pytest.raises(PathEnded, match="force_n is 1e.06, but the press could be followed only to") as failure:
        press_to_forces(_stack(), MATERIALS, (1e6,), order=2, rays=RAYS)
    assert 1 < failure.value.reached_n < 1e6
