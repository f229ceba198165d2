"""Under a dome the contact opens at the rim; without one it is the closed contact."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Press, Scene, Tissue, Waveguide

INCLUSION = Inclusion(10.0, 6.0, 80.0)


@pytest.fixture(scope="module")
def domed():
    return solve(Scene(INCLUSION, Press(indentation_mm=0.5), Waveguide(dome_mm=0.5)))


def test_a_dome_of_no_height_is_the_flat_face():
    flat, domed = (solve(Scene(INCLUSION, waveguide=Waveguide(dome_mm=dome_mm))) for dome_mm in (0.0, 1e-9))
    assert (flat.plan.contact, domed.plan.contact) == ("closed_sliding", "unilateral")
    assert domed.force_n == pytest.approx(flat.force_n, rel=2e-5)
    np.testing.assert_allclose(domed.w_mm[:-1], flat.w_mm[:-1], rtol=2e-4)  # the rim itself is singular


def test_the_rim_of_a_dome_is_free_and_its_middle_is_pressed(domed):
    touching = domed.p_kpa > 1e-3 * domed.p_kpa.max()
    contact_radius_mm = domed.r_mm[touching].max()
    assert 5.0 < contact_radius_mm < 10.9
    outside = domed.r_mm > contact_radius_mm + 0.5
    assert np.abs(domed.p_kpa[outside]).max() < 0.02 * domed.p_kpa.max()


def test_a_dome_carries_less_than_a_flat_face_and_stiffens_as_it_sinks_in(domed):
    deeper = solve(Scene(INCLUSION, Press(indentation_mm=1.0), Waveguide(dome_mm=0.5)))
    flat = solve(Scene(INCLUSION, Press(indentation_mm=1.0)))
    assert 2 * domed.force_n < deeper.force_n < flat.force_n


def test_a_force_is_reached_under_a_dome(domed):
    found = solve(Scene(INCLUSION, Press(force_n=domed.force_n), Waveguide(dome_mm=0.5)))
    assert found.indentation_mm == pytest.approx(0.5, rel=1e-4)
    assert found.baseline.force_n == pytest.approx(domed.force_n, rel=1e-6)


def test_a_nearly_incompressible_tissue_does_not_lock_under_a_dome():
    """From nu = 0.499 (displacements) to 0.4999 (mixed) the force moves by a few per mille: locking is 30 %."""
    press, probe = Press(indentation_mm=0.5), Waveguide(dome_mm=0.5)
    less, more = (solve(Scene(INCLUSION, press, probe, Tissue(poisson_ratio=nu))) for nu in (0.499, 0.4999))
    assert more.force_n == pytest.approx(less.force_n, rel=5e-3)
