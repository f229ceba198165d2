"""The face along a path of loads: forces balance, work becomes energy, and what cannot be reached is refused."""

import numpy as np
import pytest
from ngsolve import CF, GridFunction, VectorH1, exp, x, y
from scipy.integrate import simpson

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.face_state import Rays
from host_tools.forward.finite_strain.load_path import press_along, press_to_forces
from host_tools.forward.materials import FLESH, LAYERS, baseline, with_inclusion
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import AXISYMMETRIC
from host_tools.scenes.scene import Scene

SCENE = Scene(Inclusion(10, 6, 120))
COARSE = Resolution(6, 2, 1, 1, per_inclusion=4, grading=0.7)
RAYS = Rays.over(SCENE.waveguide)
LOADS_MM = (0.5, 1.0, 1.5, 2.0)


@pytest.fixture(scope="module")
def mesh():
    return axisymmetric_mesh(SCENE, order=3, resolution=COARSE)


@pytest.fixture(scope="module")
def press(mesh):
    """Return a function: loads and options in, loaded faces out."""

    def along(loads, run=press_along, order=3, **options):
        return run(mesh, with_inclusion(SCENE), loads, order=order, rays=RAYS, **options)

    return along


@pytest.fixture(scope="module", params=[False, True], ids=["sliding", "sliding_with_edge_force"])
def edge_force(request):
    return request.param


@pytest.fixture(scope="module")
def ramp(edge_force, press):
    return press(LOADS_MM, edge_force=edge_force)


def test_back_face_and_base_carry_the_same_force(ramp):
    for loaded in ramp:
        assert loaded.base_force_n == pytest.approx(loaded.face.force_n, rel=1e-8)
        assert loaded.face.contact_force_n == pytest.approx(loaded.face.force_n, rel=1e-8)


def test_the_work_of_the_back_is_the_stored_energy(ramp, edge_force):
    work_uj = 1e3 * simpson([0, *(s.face.force_n for s in ramp)], x=[0, *LOADS_MM])  # N mm is mJ
    closes = 2e-4 if edge_force else 2e-3  # the default holds the slip of the rim, which does work
    assert ramp[-1].energy_uj == pytest.approx(work_uj, rel=closes)


def test_the_pressure_of_the_deformed_area_carries_the_same_force_on_a_wider_face(ramp):
    """Ring by ring the same force; over the middle 1.3-1.9 % less pressure for each mm, since the face has widened."""
    for loaded in ramp:
        p_kpa, now_kpa = loaded.face.p_kpa[0], loaded.face.deformed_p_kpa(RAYS)[0]
        r_mm = RAYS.r_mm[0]
        now_mm = r_mm + loaded.face.outward_mm[0]
        inside = r_mm <= 0.9 * r_mm[-1]
        before_mn = simpson((p_kpa * r_mm)[inside], x=r_mm[inside])
        assert simpson((now_kpa * now_mm)[inside], x=now_mm[inside]) == pytest.approx(before_mn, rel=5e-4)
        less = 1 - (now_kpa / p_kpa)[r_mm < 5].mean()
        assert 0.013 < less / loaded.face.indentation_mm < 0.019


def test_every_load_is_kept_with_profiles_along_every_ray(ramp):
    assert [loaded.face.indentation_mm for loaded in ramp] == list(LOADS_MM)
    for loaded in ramp:
        assert loaded.face.w_mm.shape == loaded.face.p_kpa.shape == loaded.slip_mm.shape == RAYS.r_mm.shape
        assert np.isfinite([loaded.face.w_mm, loaded.face.p_kpa, loaded.slip_mm]).all()
        assert loaded.newton_iterations > 0


def test_a_light_press_is_the_linear_one(press, mesh):
    linear = LinearPress(mesh, AXISYMMETRIC, 3)
    sampler = FaceSampler(mesh, RAYS, "axisymmetric")
    small = linear.face_state(linear.displacement(with_inclusion(SCENE)), with_inclusion(SCENE), sampler).scaled(1e-3)
    (light,) = press((1e-3,))
    assert light.face.force_n == pytest.approx(small.force_n, rel=2e-4)
    assert light.face.w_mm == pytest.approx(small.w_mm, rel=2e-3)
    assert light.face.p_kpa[0, :200] == pytest.approx(small.p_kpa[0, :200], rel=2e-3)


def test_finite_and_small_strain_part_with_the_square_of_the_load(press):
    light, *loaded = press((1e-3, 0.1, 0.2, 0.4))
    apart = [one.face.w_mm[0, 0] - 1e3 * one.face.indentation_mm * light.face.w_mm[0, 0] for one in loaded]
    assert apart[1] / apart[0] == pytest.approx(4, rel=0.3)
    assert apart[2] / apart[1] == pytest.approx(4, rel=0.3)


def test_the_steps_taken_do_not_show_in_the_answer(press):
    (straight,), by_steps = press((2.0,)), press((0.3, 0.7, 1.1, 1.6, 2.0))[-1]
    assert by_steps.face.force_n == pytest.approx(straight.face.force_n, rel=1e-4)
    assert by_steps.face.w_mm == pytest.approx(straight.face.w_mm, abs=2e-5)


def test_a_force_is_met_and_is_the_force_of_its_indentation(press):
    for at_force in press((0.1, 0.3), run=press_to_forces):
        (at_depth,) = press((at_force.face.indentation_mm,))
        assert at_depth.face.force_n == pytest.approx(at_force.face.force_n, rel=1e-4)
    assert at_force.face.force_n == pytest.approx(0.3, rel=1e-8)


def test_the_refined_face_comes_close_to_a_solution_at_the_next_order(press):
    (estimated,) = press((1.0,), estimate_error=True)
    (finer,) = press((1.0,), order=4)
    off = np.abs(estimated.face.w_mm - finer.face.w_mm)[0, :200]
    assert np.abs(estimated.refined.w_mm - finer.face.w_mm)[0, :200].max() < 0.4 * off.max()


def test_a_mesh_that_is_deformed_inside_is_pressed_as_before():
    """Moving the nodes of a homogeneous slab by up to 0.7 mm, face and outline kept, leaves the scene what it was."""
    scene = Scene()
    mesh = axisymmetric_mesh(scene, order=3, resolution=Resolution(4, 1.5, 1, 1, grading=0.6))

    def pressed():
        (loaded,) = press_along(mesh, baseline(scene), (1.0,), order=3, rays=RAYS)
        return loaded

    before = pressed()
    bulge = GridFunction(VectorH1(mesh, order=4))
    shape = x * exp(-((x - 10) ** 2) / 100 - (y + 10) ** 2 / 50) * (y / 10) ** 2 * (1 + y / 30) / 10
    bulge.Set(CF((shape, shape)), definedon=mesh.Materials(FLESH))
    on_face = bulge.space.GetDofs(mesh.Boundaries("face") + mesh.Materials(LAYERS).Boundaries())
    for dof in np.flatnonzero(list(on_face)):
        bulge.vec[dof] = 0.0
    mesh.SetDeformation(bulge)
    assert pressed().face.force_n == pytest.approx(before.face.force_n, rel=1e-4)
    assert pressed().face.w_mm == pytest.approx(before.face.w_mm, abs=5e-5)


@pytest.mark.parametrize("loads", [(), (0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (1.0, float("inf")), (float("nan"),)])
def test_loads_that_do_not_ascend_are_refused(press, loads):
    with pytest.raises(InvalidQuantity, match="indentations_mm is .* but must be ascending"):
        press(loads)


def test_a_ramp_led_by_that_of_other_materials_ends_where_it_would_alone_and_sooner(mesh):
    forces_n, options = (0.15, 0.3, 0.5), {"order": 3, "rays": RAYS}
    arrivals = {}
    press_to_forces(mesh, baseline(SCENE), forces_n, **options, arrivals=arrivals)
    assert tuple(arrivals) == forces_n
    led = press_to_forces(mesh, with_inclusion(SCENE), forces_n, **options, arrivals=arrivals)
    alone = press_to_forces(mesh, with_inclusion(SCENE), forces_n, **options)
    for one, other in zip(led, alone, strict=True):
        assert one.face.force_n == pytest.approx(other.face.force_n, rel=1e-8)
        assert one.face.indentation_mm == pytest.approx(other.face.indentation_mm, rel=1e-7)
        np.testing.assert_allclose(one.face.w_mm, other.face.w_mm, rtol=0, atol=1e-6 * other.face.w_mm.max())
        np.testing.assert_allclose(one.face.p_kpa, other.face.p_kpa, rtol=0, atol=1e-6 * other.face.p_kpa.max())
    assert led[-1].newton_iterations < alone[-1].newton_iterations
