"""The reference light: energy is kept, limits known on paper are met, and the noise it states is the noise it has."""

import math

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.skin import Skin
from host_tools.optics.traced import TracedFace
from host_tools.optics.tracer import trace
from host_tools.scenes.light_block import LightBlock

X = np.linspace(-12.0, 12.0, 97)
BLOCK, SKIN = LightBlock(), Skin()


def face(contact=0.0, depth_mm=0.0, width_mm=2.5, *, skin_behind=True):
    x, y = np.meshgrid(X, X)
    w = depth_mm * np.exp(-(x**2 + y**2) / (2 * width_mm**2))
    return TracedFace(X, X, w, np.full_like(w, contact), skin_behind)


@pytest.mark.parametrize(
    ("block", "scene"),
    [
        (BLOCK, face(0.4, 1.0)),
        (LightBlock(wall_reflectance=0.95), face(1.0)),
        (LightBlock(haze_per_mm=0.02), face(0.2, 0.5)),
        (LightBlock(led_coupling="embedded"), face(0.0, 1.5, skin_behind=False)),
    ],
    ids=["dimple", "white walls", "haze", "embedded, dark behind"],
)
def test_all_light_is_accounted_for(block, scene):
    ledger = trace(block, scene, SKIN, rays=20_000).ledger
    assert sum(ledger.values()) == pytest.approx(1.0, abs=1e-3)
    assert abs(ledger["roulette"]) < 0.01
    assert min(value for name, value in ledger.items() if name != "roulette") >= 0.0


def test_a_flat_face_with_nothing_behind_shows_nothing():
    traced = trace(BLOCK, face(skin_behind=False), SKIN, rays=50_000)
    assert traced.radiance.max() == 0.0
    assert traced.specular_into_aperture == 0.0


def test_a_smooth_dimple_with_nothing_behind_shows_nothing_although_light_leaves():
    traced = trace(BLOCK, face(depth_mm=1.5, skin_behind=False), SKIN, rays=50_000)
    assert traced.bottom_loss > 0.01
    assert traced.radiance.max() == 0.0


def test_without_any_index_contrast_light_flies_straight():
    # E = sum of cos(at LED) cos(at face) / (pi r^2), Lambertian skin: radiance = albedo E / pi.
    clear = LightBlock(refractive_index=1.0, glass_refractive_index=1.0, wall_reflectance=0.0, led_radius_mm=0.05)
    skin = Skin(refractive_index=1.0, spread_mm=0.0)
    traced = trace(clear, face(1.0), skin, rays=200_000)
    middle = np.abs(traced.x_mm) < 3.0
    x, y = np.meshgrid(traced.x_mm[middle], traced.y_mm[middle])
    away = np.array([12 - x, 12 - y, 12 + x, 12 + y])
    r2 = away**2 + 25.0 + np.array([y, x, y, x]) ** 2
    expected = 0.5 / math.pi * (5 * away / (math.pi * r2**2)).mean(axis=0)
    assert traced.radiance[np.ix_(middle, middle)].mean() == pytest.approx(expected.mean(), rel=0.04)
    assert traced.ledger["window"] == 0.0
    assert traced.ledger["bottom"] + traced.ledger["skin"] + traced.ledger["walls"] == pytest.approx(1.0, abs=0.01)


def test_without_any_index_contrast_contact_makes_no_difference():
    clear = LightBlock(refractive_index=1.0, glass_refractive_index=1.0)
    wet, dry = (trace(clear, face(phi), Skin(refractive_index=1.0), rays=5_000) for phi in (1.0, 0.0))
    np.testing.assert_allclose(wet.radiance, dry.radiance, rtol=1e-9)


def test_contact_is_seen_a_hundred_times_brighter_than_an_air_gap():
    wet, dry = (trace(BLOCK, face(phi), SKIN, rays=100_000) for phi in (1.0, 0.0))
    middle = slice(20, 28)
    assert wet.radiance[middle, middle].mean() > 100 * dry.radiance[middle, middle].mean()


def test_an_led_cast_into_the_block_leaks_where_one_behind_a_window_does_not():
    outside, inside = (
        trace(LightBlock(led_coupling=coupling), face(), SKIN, rays=50_000).radiance.mean()
        for coupling in ("air", "embedded")
    )
    assert inside > 5 * outside


def test_leds_add_up():
    scene = face(0.5, 0.8)
    ones = [trace(BLOCK, scene, SKIN, led_ratio=np.eye(4)[k], rays=50_000, seed=k).radiance for k in range(4)]
    mixed = trace(BLOCK, scene, SKIN, led_ratio=(1.0, 0.5, 0.25, 0.0), rays=100_000, seed=9)
    expected = (ones[0] + 0.5 * ones[1] + 0.25 * ones[2]) / 1.75
    blocks = (mixed.radiance - expected).reshape(6, 8, 6, 8).mean(axis=(1, 3))
    assert np.abs(blocks).max() < 0.05 * expected.max()
    assert mixed.radiance.sum() == pytest.approx(expected.sum(), rel=0.02)


def test_noise_falls_with_the_root_of_the_rays_and_is_what_two_seeds_differ_by():
    few = trace(BLOCK, face(0.5), SKIN, rays=20_000)
    many = [trace(BLOCK, face(0.5), SKIN, rays=80_000, seed=seed) for seed in (2, 3)]
    noise = many[0].noise_ratio * many[0].radiance.max()
    assert few.noise_ratio * few.radiance.max() / noise == pytest.approx(2.0, rel=0.1)
    assert np.std(many[0].radiance - many[1].radiance) / (math.sqrt(2) * noise) == pytest.approx(1.0, rel=0.1)


def test_one_seed_gives_one_answer():
    first, again, other = (trace(BLOCK, face(0.3), SKIN, rays=2_000, seed=seed).radiance for seed in (7, 7, 8))
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)


def test_light_behind_a_mirror_symmetric_face_is_mirror_symmetric():
    radiance = trace(BLOCK, face(0.5, 1.0), SKIN, rays=100_000).radiance
    quarters = radiance.reshape(2, 24, 2, 24).sum(axis=(1, 3))
    assert np.ptp(quarters) < 0.04 * quarters.mean()


@pytest.mark.parametrize(
    ("change", "name"),
    [({"led_ratio": (0, 0, 0, 0)}, "led_ratio"), ({"led_ratio": (1, 1)}, "led_ratio"), ({"rays": 3}, "rays")],
)
def test_a_scene_without_light_or_rays_is_refused(change, name):
    with pytest.raises(InvalidQuantity, match=name):
        trace(BLOCK, face(), SKIN, **change)


def test_a_face_that_reaches_the_leds_is_refused():
    with pytest.raises(InvalidQuantity, match="w_mm"):
        trace(BLOCK, face(depth_mm=4.5), SKIN, rays=1_000)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"x_mm": X**3}, "x_mm"),
        ({"w_mm": np.zeros((4, 97))}, "w_mm"),
        ({"contact_ratio": np.full((97, 97), 1.1)}, "contact_ratio"),
        ({"contact_ratio": np.full((97, 97), np.nan)}, "contact_ratio"),
    ],
)
def test_a_face_that_is_no_grid_of_ratios_is_refused(change, name):
    good = {"x_mm": X, "y_mm": X, "w_mm": np.zeros((97, 97)), "contact_ratio": np.zeros((97, 97))}
    with pytest.raises(InvalidQuantity, match=name):
        TracedFace(**{**good, **change})
