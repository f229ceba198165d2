"""Derivatives by mesh velocity and one linear solve are the limits of differences between whole solves."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.derivatives.equilibrium import LinearEquilibrium, SlidingEquilibrium
from host_tools.forward.derivatives.mesh_velocity import mesh_velocities, moved
from host_tools.forward.derivatives.sensitive_presses import sensitive_ramp
from host_tools.forward.derivatives.sensitivity import FORCE, face_sensitivity
from host_tools.forward.derivatives.sliding_parts import SlidingParts
from host_tools.forward.face_state import Rays
from host_tools.forward.finite_strain.equilibrium_path import EquilibriumPath
from host_tools.forward.finite_strain.loaded_face import face_state
from host_tools.forward.finite_strain.newton import EnergyNewton, NewtonStatus
from host_tools.forward.finite_strain.sliding import SlidingContact
from host_tools.forward.materials import Elasticity, baseline, only, with_inclusion
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import AXISYMMETRIC
from host_tools.scenes.scene import Placement, Scene

SCENE = Scene(Inclusion(10, 6, 80))
COARSE = Resolution(6, 2, 1, 1, per_inclusion=4, grading=0.7)
ORDER, PRESS_MM = 3, 1.5
WITH_INCLUSION = with_inclusion(SCENE)
PARTS = {"youngs_modulus_kpa": only(WITH_INCLUSION, "inclusion"), "tissue_modulus_kpa": only(WITH_INCLUSION, "tissue")}
LENGTHS = ("size_mm", "depth_mm", "thickness_mm")
INNER = slice(0, 190)
"""Radii within 0.86 of the face; the rim is singular."""


@pytest.fixture(scope="module")
def mesh():
    return axisymmetric_mesh(SCENE, order=ORDER, resolution=COARSE)


@pytest.fixture(scope="module")
def velocities(mesh):
    return mesh_velocities(SCENE, mesh)


@pytest.fixture(scope="module")
def sampler(mesh):
    return FaceSampler(mesh, Rays.over(SCENE.waveguide), "axisymmetric")


def stiffened(name, step):
    material = {"youngs_modulus_kpa": "inclusion", "tissue_modulus_kpa": "tissue"}[name]
    factor = np.exp(step)
    moduli = {key: E * (factor if key.startswith(material) else 1.0) for key, E in WITH_INCLUSION.modulus_kpa.items()}
    return Elasticity(moduli, WITH_INCLUSION.poisson_ratio)


def at_step(name, step, mesh, velocities, solve):
    """Solve the scene with the logarithm of one quantity changed."""
    if name in LENGTHS:
        with moved(mesh, velocities[name], step):
            return solve(WITH_INCLUSION)
    return solve(stiffened(name, step))


def difference(name, step, mesh, velocities, solve):
    more, less = (at_step(name, sign * step, mesh, velocities, solve) for sign in (1, -1))
    return (more.w_mm - less.w_mm) / (2 * step), (more.p_kpa - less.p_kpa) / (2 * step)


@pytest.fixture(scope="module")
def small(mesh, velocities, sampler):
    return face_sensitivity(
        LinearEquilibrium(LinearPress(mesh, AXISYMMETRIC, ORDER), WITH_INCLUSION, PARTS, sampler), velocities
    )


@pytest.mark.parametrize("name", [*LENGTHS, *PARTS])
def test_differences_at_equal_force_tend_to_the_derivative_with_the_square_of_the_step(
    small, mesh, velocities, sampler, name
):
    def solve(elasticity):
        press = LinearPress(mesh, AXISYMMETRIC, ORDER)
        face = press.face_state(press.displacement(elasticity), elasticity, sampler)
        return face.scaled(small.face.force_n / face.force_n)

    rate, errors = small.rates[name], []
    for step in (0.08, 0.04, 0.001):
        w, p = difference(name, step, mesh, velocities, solve)
        errors.append([np.abs(w - rate.w_mm).max(), np.abs(p - rate.p_kpa)[:, INNER].max()])
    peak = [np.abs(rate.w_mm).max(), np.abs(rate.p_kpa)[:, INNER].max()]
    assert np.divide(errors[0], errors[1]) == pytest.approx([4, 4], abs=0.2)
    assert (np.divide(errors[2], peak) < 1e-5).all()


def test_everything_is_in_proportion_to_the_force(small):
    assert small.rates[FORCE].w_mm == pytest.approx(small.face.w_mm, abs=1e-9)
    assert small.rates[FORCE].p_kpa == pytest.approx(small.face.p_kpa, rel=1e-6, abs=1e-9)
    near = small.at_force(1.001 * small.face.force_n)
    assert near.face.w_mm == pytest.approx(1.001 * small.face.w_mm, rel=1e-5)


def test_one_factor_on_all_moduli_divides_the_face_at_equal_force(small, mesh, sampler):
    """w is in proportion to the force over the moduli: the derivatives by their logarithms add up to -w."""
    press = LinearPress(mesh, AXISYMMETRIC, ORDER)
    probe = LinearEquilibrium(press, WITH_INCLUSION, {"probe": only(WITH_INCLUSION, "layer")}, sampler)
    by_probe = face_sensitivity(probe, {}).rates["probe"]
    by_flesh = sum(small.rates[name].w_mm for name in PARTS)
    assert by_flesh + by_probe.w_mm == pytest.approx(-small.face.w_mm, abs=1e-8 * np.abs(small.face.w_mm).max())


def test_where_an_inclusion_would_be_hardly_matters_without_it(small, mesh, velocities, sampler):
    """On elements so coarse to 2 %: that is why both presses are solved on one mesh."""
    press = LinearPress(mesh, AXISYMMETRIC, ORDER)
    parts = {"tissue_modulus_kpa": only(baseline(SCENE), "tissue", "inclusion")}
    inclusion_free = face_sensitivity(LinearEquilibrium(press, baseline(SCENE), parts, sampler), velocities)
    for name in ("size_mm", "depth_mm"):
        by_baseline, by_inclusion = (
            np.abs(found.rates[name].w_mm)[:, INNER].max() for found in (inclusion_free, small)
        )
        assert 0 < by_baseline < 0.02 * by_inclusion


@pytest.fixture(scope="module")
def pressed(mesh, velocities):
    contact = SlidingContact(mesh, WITH_INCLUSION, ORDER)
    parts = SlidingParts(contact, PARTS, velocities)
    path = EquilibriumPath(contact)
    path.press_to(PRESS_MM)
    return path, parts


@pytest.fixture(scope="module")
def finite(pressed, velocities, sampler):
    path, parts = pressed
    return face_sensitivity(SlidingEquilibrium(path.contact, path.newton, PRESS_MM, parts, sampler), velocities)


@pytest.mark.parametrize("name", [*LENGTHS, *PARTS])
def test_with_the_labels_kept_differences_tend_to_the_derivative(finite, pressed, mesh, velocities, sampler, name):
    path, parts = pressed

    def face(step):
        def solve(elasticity):
            contact = SlidingContact(mesh, elasticity, ORDER)
            contact.free = path.contact.free
            for vector, now in zip(contact.memory, path.contact.memory, strict=True):
                vector.data = now
            contact.u.vec[parts.rim] += step * PRESS_MM * parts.rim_rates[name]
            assert EnergyNewton(contact.energy, contact.u, contact.free).descend().status is NewtonStatus.CONVERGED
            return face_state(contact, PRESS_MM, sampler)

        return at_step(name, step, mesh, velocities, solve)

    rate, by_force = finite.rates[name], finite.rates[FORCE]
    share = rate.indentation_mm / by_force.indentation_mm  # of the force that keeps the indentation
    expected = np.stack([rate.w_mm - share * by_force.w_mm, rate.p_kpa - share * by_force.p_kpa])[:, 0, INNER]
    errors = []
    for step in (0.02, 0.01):
        more, less = face(step), face(-step)
        found = np.stack([more.w_mm - less.w_mm, more.p_kpa - less.p_kpa])[:, 0, INNER] / (2 * step)
        errors.append(np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1))
    assert (errors[1] < 1e-3).all()
    assert errors[0] / errors[1] == pytest.approx([4, 4], abs=0.5)


@pytest.mark.parametrize("name", ["size_mm", "youngs_modulus_kpa"])
def test_a_whole_path_anew_agrees_to_what_the_choice_of_labels_is_worth(finite, mesh, velocities, sampler, name):
    def solve(elasticity):
        path = EquilibriumPath(SlidingContact(mesh, elasticity, ORDER))
        path.push_to(finite.face.force_n)
        return face_state(path.contact, path.indentation_mm, sampler)

    w, _ = difference(name, 0.02, mesh, velocities, solve)
    rate = finite.rates[name].w_mm
    assert np.abs(w - rate)[:, INNER].max() < 0.03 * np.abs(rate[:, INNER]).max()


def test_both_orders_of_a_ramp_agree_and_carry_the_force():
    ramps = sensitive_ramp(SCENE, (0.2, 0.4), strain="small")
    for coarse, fine in zip(ramps[3], ramps[4], strict=True):
        assert [coarse.pressed.face.force_n, coarse.baseline.face.force_n] == pytest.approx([coarse.force_n] * 2)
        rates = [press.pressed.rates["size_mm"].w_mm[0, INNER] for press in (coarse, fine)]
        assert rates[0] == pytest.approx(rates[1], abs=2e-3 * np.abs(rates[1]).max())


@pytest.mark.parametrize(
    ("scene", "quantity"),
    [
        (Scene(None), "inclusion"),
        (replace(SCENE, placement=Placement(offset_x_mm=3.0)), "scene"),
    ],
)
def test_scenes_that_the_derivatives_do_not_serve_are_refused(scene, quantity):
    with pytest.raises(InvalidQuantity) as refusal:
        sensitive_ramp(scene, (0.3,), strain="small")
    assert refusal.value.quantity == quantity
