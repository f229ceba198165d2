"""The same presses whatever differs: truths and noise are those of the design, and a scan begins with its press."""

import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS
from device.measurement.ramp_modes.radial_profile import RESPONSE
from device.measurement.recording.ring_means import RINGS
from device.simulation.physics.world import AS_BELIEVED, OverLesion, World
from host_tools.press_models.press_samples import profile_rows
from host_tools.press_models.quick_training import quick_rows
from host_tools.scores.foreign_presses import FURTHER_MM
from host_tools.scores.one_thing.tried_presses import Setting, random_design, scans_of, tried_presses

DESIGN = random_design(4, 2, seed=3)


@pytest.fixture(scope="module")
def noise():
    return read_ramp_model(MODELS / "standard").answers.noise


def tried(tables, noise, *worlds, design=DESIGN):
    both = [Setting(tables, world) for world in (worlds * 2)[:2]]
    return tried_presses(design, lambda number, rng: both, noise, jobs=1)


@pytest.fixture(scope="module")
def believed(tables, noise):
    return tried(tables, noise, AS_BELIEVED)


def test_a_scan_begins_with_the_single_press_and_keeps_its_reference(believed):
    assert [len(one.rows) for one in believed.scans.seen] == [2, 2]
    for single, scan in zip(believed.single.seen, believed.scans.seen, strict=False):
        np.testing.assert_array_equal(single.rows[0], scan.rows[0])
        np.testing.assert_array_equal(scan.rows[0, RESPONSE], scan.rows[1, RESPONSE])
    assert ((FURTHER_MM[0] <= DESIGN.further_mm) & (DESIGN.further_mm <= FURTHER_MM[1])).all()


def test_three_in_ten_are_scans_and_at_least_one():
    assert [scans_of(presses) for presses in (3, 10, 40)] == [1, 3, 12]


def test_a_single_press_has_the_noise_of_one_whether_it_is_pressed_again_or_not(tables, noise, believed):
    alone = tried(tables, noise, AS_BELIEVED, design=DESIGN._replace(scans=0))
    np.testing.assert_allclose(alone.single.seen[0].rows, believed.single.seen[0].rows, rtol=0, atol=1e-12)


def test_rows_are_exact_but_for_noise(tables, noise, believed):
    exact = profile_rows(tables, DESIGN.parameters)
    for row, seen in zip(exact, believed.single.seen, strict=True):
        apart = (seen.rows[0] - row)[: RESPONSE.stop]
        deviations = apart / np.sqrt(np.diag(noise.covariance(row))[: RESPONSE.stop])
        assert 0.2 < np.sqrt(np.mean(deviations**2)) < 2.5


def test_what_differs_is_the_world_and_not_the_noise(tables, noise, believed):
    """A gain over the lesion multiplies the exact contrast's light; noise, which depends on it little, stays."""
    brighter = tried(tables, noise, World(lesion=OverLesion(albedo_ratio=1.02)))
    of_world = profile_rows(tables, DESIGN.parameters, world=World(lesion=OverLesion(albedo_ratio=1.02)))
    change = of_world - profile_rows(tables, DESIGN.parameters)
    for number, one in enumerate(brighter.single.seen):
        seen = one.rows[0, :RINGS] - believed.single.seen[number].rows[0, :RINGS]
        assert np.abs(change[number, :RINGS]).min() > 0.005
        np.testing.assert_allclose(seen, change[number, :RINGS], atol=2e-3)


def test_a_held_press_is_read_at_half_a_newton_of_the_ramp(tables, believed):
    exact = quick_rows(profile_rows(tables, DESIGN.parameters), np.full(4, 0.5))
    rows = np.array([one.row for one in believed.held])
    assert np.abs(rows - exact).max() < 0.06
    assert np.abs(rows - exact)[:, :RINGS].max() > 1e-4
    assert (np.array([one.elongation_ratio for one in believed.held]) >= 0).all()
