"""Faces to light on rings: what ideal sensors show, and how traced light follows pressure and skin."""

import numpy as np
import pytest

from host_tools.cramer_rao.observed_press import SKIN, IdealImageModel, LightImageModel, Profiles, smooth
from host_tools.cramer_rao.rings import Rings
from host_tools.forward.face_state import Rays
from host_tools.scenes.scene import Waveguide

RAYS = Rays.over(Waveguide())
R_MM = RAYS.r_mm[0]
RINGS = Rings.within(9.9)
FACE = Profiles(0.2 + 0.001 * RAYS.r_mm**2, 1.5 + 0.4 * np.exp(-(RAYS.r_mm**2) / 18))
INCLUSION = Profiles(np.zeros_like(RAYS.r_mm), np.exp(-(RAYS.r_mm**2) / 18))


@pytest.fixture(scope="module")
def light():
    return LightImageModel(RAYS, RINGS)


@pytest.mark.parametrize(("quantity", "level"), [("pressure", 3.0), ("displacement", 0.5)])
def test_an_ideal_sensor_shows_its_quantity_and_no_skin(quantity, level):
    image, even = IdealImageModel(RAYS, RINGS, quantity), np.ones_like(RAYS.r_mm)
    assert image.light(Profiles(0.5 * even, 3.0 * even)) == pytest.approx(np.full(len(RINGS.r_mm), level))
    assert image.change(FACE, INCLUSION) == pytest.approx(image.light(INCLUSION))
    assert not any(change.any() for change in image.changes_by_skin(FACE).values())


def test_an_ideal_sensor_sees_an_inclusion_beside_the_axis_in_the_first_harmonic():
    """1 + cos(angle) has the mean 1 and the first harmonic 1."""
    rays = Rays.over(Waveguide(), angles=16)
    field = np.ones_like(rays.r_mm) + np.cos(rays.angle_rad)[:, None]
    harmonics = IdealImageModel(rays, RINGS, "displacement").light(Profiles(field, field)).reshape(4, -1)
    assert harmonics == pytest.approx(np.outer([1, 1, 0, 0], np.ones(len(RINGS.r_mm))), abs=1e-12)


def test_pressure_brightens_where_it_acts(light):
    change = light.change(FACE, INCLUSION)
    assert (change[RINGS.r_mm < 6] > 0).all()
    assert change[0] > 10 * abs(change[-1])


def test_light_follows_the_pressure_over_that_of_the_skin(light):
    """Contact is 1 - exp(-p / p0): a harder skin is a lighter press."""
    by_pressure = light.change(FACE, Profiles(np.zeros_like(FACE.w_mm), FACE.p_kpa))
    by_skin = light.changes_by_skin(FACE)["contact_pressure_kpa"]
    assert by_skin == pytest.approx(-by_pressure, abs=2e-3 * np.abs(by_pressure).max())


def test_a_paler_skin_gives_back_more_than_in_proportion(light):
    """What the face sends back once more comes on top."""
    reference_response = light.changes_by_skin(FACE)["albedo"] / light.light(FACE)
    assert (reference_response > 1).all()
    assert (reference_response < 1.6).all()
    assert set(light.changes_by_skin(FACE)) == set(SKIN)


def test_a_change_counts_in_proportion(light):
    twice = Profiles(2 * INCLUSION.w_mm, 2 * INCLUSION.p_kpa)
    once = light.change(FACE, INCLUSION)
    assert light.change(FACE, twice) == pytest.approx(2 * once, rel=1e-3, abs=1e-3 * np.abs(once).max())


def test_a_face_that_does_not_change_changes_no_light(light):
    nothing = Profiles(INCLUSION.p_kpa, np.zeros_like(INCLUSION.p_kpa))  # deformation alone is left out
    assert not light.change(FACE, nothing).any()


def test_ringing_inside_an_element_is_smoothed_and_the_force_stays():
    ringing = 2.0 + np.sin(2 * np.pi * RAYS.r_mm / 0.5)
    inner = (R_MM > 1) & (R_MM < 10)
    assert smooth(R_MM, ringing)[0, inner] == pytest.approx(2.0, abs=0.07)
    assert smooth(R_MM, np.full_like(RAYS.r_mm, 2.0)) == pytest.approx(np.full_like(RAYS.r_mm, 2.0))
