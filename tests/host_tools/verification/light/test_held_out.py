"""The shipped table against traced light: the probe's images are those of the physics, within what is promised."""

from pathlib import Path

import numpy as np
import pytest

from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.surface_table import load_surface_table
from host_tools.scenes.light_block import LightBlock
from host_tools.verification.light.lookup import cell_means, dimple_scenes, held_out_errors, pressed_scenes

MODELS = Path(__file__).parents[4] / "models" / "simulated_probe"
RAYS = 100_000


@pytest.fixture(scope="module")
def lookup():
    return LookupOptics.load(MODELS)


@pytest.fixture(scope="module")
def rows(lookup):
    steepest = list(dimple_scenes(lookup))[-1]
    over_an_inclusion = list(pressed_scenes(lookup, load_surface_table(MODELS)))[1]
    return held_out_errors(lookup, LightBlock(**lookup.block), [steepest, over_an_inclusion], RAYS)


def test_the_shipped_table_is_of_the_default_block(lookup):
    assert LightBlock(**lookup.block) == LightBlock()


def test_the_shipped_table_is_within_three_percent_of_the_peak_beyond_the_tracers_noise(rows):
    for row in rows:
        assert row.rms_of_peak_ratio**2 - row.noise_ratio**2 < 0.03**2, row


def test_the_shipped_table_has_the_traced_sum_and_peak(rows):
    for row in rows:
        assert abs(row.sum_error_ratio) < 0.03, row
        assert abs(row.peak_error_ratio) < 0.10, row


def test_the_faces_are_as_announced(lookup):
    dimples = list(dimple_scenes(lookup))
    presses = list(pressed_scenes(lookup, load_surface_table(MODELS)))
    assert all(0.25 < scene.w_mm.max() < 1.29 for scene in dimples)
    x, y = np.meshgrid(lookup.x_mm, lookup.y_mm)
    assert presses[0].p_kpa[np.hypot(x, y) < 11].mean() == pytest.approx(500 / (np.pi * 121), rel=0.02)  # 0.5 N, kPa
    assert all(scene.p_kpa[np.hypot(x, y) > 11].max() == 0.0 for scene in presses)


def test_cells_average_what_overlaps_them():
    fine = (np.arange(160) + 0.5) * 0.15 - 12
    means = cell_means(fine, 12.0, 48)
    np.testing.assert_allclose(means.sum(axis=1), 1.0)
    # 0.5 mm are 3 1/3 fine cells: the middle of each of three coarse cells, 1.5 mm, is met exactly.
    np.testing.assert_allclose((means @ fine).reshape(16, 3).mean(axis=1), (np.arange(16) + 0.5) * 1.5 - 12, atol=1e-9)
