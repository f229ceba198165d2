"""The table of light: right where paper knows the answer, reproducible, and what the probe loads."""

import math
from dataclasses import replace

import numpy as np
import pytest

from device.simulation.physics.light_table import load_light_table
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.virtual_probe import probe_of_table, table_record
from host_tools.optics.build_lookup import STEPS, light_field, write_light_table
from host_tools.scenes.light_block import LightBlock
from host_tools.scenes.probe_file import simulated_probe

CLEAR = LightBlock(refractive_index=1.0, glass_refractive_index=1.0, led_radius_mm=0.05)


@pytest.fixture(scope="module")
def clear_field():
    return light_field(CLEAR, np.array([0.0, 1.0]), 12, 400_000, seed=1)


def test_vector_irradiance_of_a_small_led_is_its_intensity_over_distance_squared(clear_field):
    # Lambertian, no index contrast: |E| = cos / (pi r^2), along the ray; the cell 5 mm beside the axis, 9 mm away.
    vectors, _ = clear_field
    dx, dy, dz = -9.0, 5.0, 4.0
    r = math.sqrt(dx**2 + dy**2 + dz**2)
    expected = -dx / r / (math.pi * r**2) * np.array([dx, dy, dz]) / r
    np.testing.assert_allclose(vectors[0, 1, :, 8, 7], expected, rtol=0.1)


def test_without_a_reflecting_bottom_no_light_comes_from_it(clear_field):
    vectors, _ = clear_field
    assert np.abs(vectors[1]).max() == 0.0


def test_the_light_is_mirror_symmetric(clear_field):
    vectors, half_angle = clear_field
    np.testing.assert_allclose(vectors[:, :, 2], vectors[:, :, 2, ::-1])
    np.testing.assert_allclose(vectors[:, :, 1], -vectors[:, :, 1, ::-1])
    np.testing.assert_allclose(half_angle, half_angle[:, :, ::-1])


def test_an_led_is_seen_under_its_radius_over_distance():
    wide = LightBlock(refractive_index=1.0, glass_refractive_index=1.0, led_radius_mm=1.5)
    _, half_angle = light_field(wide, np.array([0.0]), 80, 2_000_000, seed=1)
    # On the axis in the middle of the face: 12 mm away, 5 mm up; the mean over few cells, for their noise.
    assert half_angle[0, 0, 38:42, 38:42].mean() == pytest.approx(1.5 / 13, rel=0.1)


def test_a_table_is_written_step_by_step_and_one_seed_gives_one_table(tmp_path):
    told = []
    write_light_table(tmp_path / "a", rays=20_000, seed=4, on_step=told.append)
    write_light_table(tmp_path / "b", rays=20_000, seed=4)
    assert tuple(told) == STEPS
    assert (tmp_path / "a/light_table.npz").read_bytes() == (tmp_path / "b/light_table.npz").read_bytes()
    table = load_light_table(tmp_path / "a")
    assert LightBlock(**table.block) == LightBlock()
    assert table_record(tmp_path / "a", "light_table")["probe"]["serial"] == "SIM-0001"
    assert LookupOptics(table).x_mm.shape == (160,)


def test_haze_and_walls_go_into_the_table(tmp_path):
    own = simulated_probe()
    hazy = replace(own, serial="HAZY", block=replace(own.block, haze_per_mm=0.01))
    table = write_light_table(tmp_path, rays=100_000, probe=hazy)
    assert table.block["haze_per_mm"] == 0.01
    assert probe_of_table(tmp_path, "light_table") == hazy.sha256 != own.sha256
    assert table.background.sum() > 0.0
    assert table.stray.min() >= 0.0
    assert 0.0 < table.returned_ratio.min() < table.returned_ratio.max() < 0.2
