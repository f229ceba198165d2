"""Dots to a camera: places that a known camera sees, and recordings of the virtual probe's."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from device.files.toml_record import InvalidRecord
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.camera_geometry import CameraGeometry
from device.measurement.recording.pixel_scale import PixelScale
from device.simulation.grid_target import GridTarget
from device.simulation.physics.lens import TrueCamera
from device.simulation.physics.world import World
from device.simulation.scenario import Scenario
from host_tools.calibration import camera_fit
from host_tools.calibration.camera_fit import LEAST_SIZE_RATIO, MOST_PLAYS, GridPrint, camera_of, fit_camera
from host_tools.calibration.grid_dots import SeenGrid
from host_tools.calibration.phantom import grid_recordings
from host_tools.scenes.probe_file import simulated_probe

STATED, TRUE = PixelScale(0.03125, 0.03646), PixelScale(0.0316, 0.0362)
GEOMETRY = CameraGeometry(TRUE, 0.3, -0.2, 1.5)
NUMBER = np.array([(column, row) for column in range(-4, 5) for row in range(-3, 4)])


def seen(turn_deg, middle_mm=(0.0, 0.0), noise_mm=0.0, seed=1, bent_mm=0.0):
    """Return the dots of a grid as the camera sees them, in mm of the stated pixel size."""
    turned = 2.0 * (NUMBER @ np.array([1, 1j])) * np.exp(1j * np.deg2rad(turn_deg)) + complex(*middle_mm)
    bent = bent_mm * np.sin(NUMBER[:, 0])
    image_mm = np.stack(GEOMETRY.image_mm(turned.real + bent, turned.imag), axis=1)
    stated = image_mm * (STATED.mm_per_px_x / TRUE.mm_per_px_x, STATED.mm_per_px_y / TRUE.mm_per_px_y)
    return SeenGrid(stated + noise_mm * np.random.default_rng(seed).standard_normal(stated.shape), NUMBER)


def values(fitted):
    return np.array([value for _, value, _, _ in fitted.rows()])


TRUTH = np.array([TRUE.mm_per_px_x, TRUE.mm_per_px_y, 0.3, -0.2, 1.5])


@pytest.mark.parametrize("turn_deg", [-40.0, 3.0, 100.0])
def test_the_camera_that_saw_the_dots_is_found(turn_deg):
    found = fit_camera([seen(turn_deg)], STATED, GridPrint())
    np.testing.assert_allclose(values(found), TRUTH, atol=1e-6)
    assert found.dots == len(NUMBER)
    assert found.left_mm < 1e-6


def test_errors_are_as_large_as_is_stated():
    """Forty cameras with noise of dots and play of caps: errors of the axis over their standard deviations are 1.

    Of the others they are less: what no residual shows is not drawn here.
    """
    printed, rng = GridPrint(pitch_mm_tolerance=1e-6, play_mm=0.02), np.random.default_rng(7)
    over = []
    for number in range(40):
        middles = printed.play_mm * rng.standard_normal((3, 2))
        grids = [seen(30.0 * cap, middles[cap], 0.004, seed=3 * number + cap) for cap in range(3)]
        found = fit_camera(grids, STATED, printed)
        over.append((values(found) - TRUTH) / found.deviation)
    ratios = np.sqrt(np.mean(np.square(over), axis=0))
    np.testing.assert_allclose(ratios[2:4], 1.0, atol=0.3)
    assert ratios.max() < 1.3


def test_pixel_sizes_are_known_no_better_than_the_pitch():
    found = fit_camera([seen(3.0, noise_mm=1e-4)], STATED, GridPrint(pitch_mm_tolerance=0.002))
    assert found.deviation[0] == pytest.approx(np.hypot(0.001, LEAST_SIZE_RATIO) * TRUE.mm_per_px_x, rel=0.01)


def test_a_grid_that_is_bent_is_refused():
    with pytest.raises(InvalidQuantity, match="root mean square distance of dots from the grid is 0.0"):
        fit_camera([seen(0.0, bent_mm=0.08)], STATED, GridPrint())


@pytest.mark.parametrize(("key", "value"), [("pitch_mm", 0.0), ("pitch_mm_tolerance", 0.0), ("play_mm", 0.0)])
def test_a_print_without_tolerance_is_refused(key, value):
    with pytest.raises(InvalidQuantity, match=key):
        GridPrint(**{key: value})


CAMERA = TrueCamera(1.008, 0.994, 0.2, -0.3, rim_distortion_percent=-1.2, further_blur_mm=0.03)


@pytest.fixture(scope="module")
def recordings(tables):
    """A grid put on twice, seen by a camera that is off in everything; the cap fits without play."""
    scenario = Scenario(world=World(camera=CAMERA))
    made = grid_recordings(2, GridTarget(), tables, play_mm=0.0, seed=5, scenario=scenario)
    return {f"grid{number}": one for number, one in enumerate(made, start=1)}


def test_the_virtual_probes_camera_is_found_through_light_noise_and_eight_bits(recordings):
    found = camera_of(recordings, GridPrint(play_mm=1e-4), simulated_probe())
    truth = np.array([1.008 * STATED.mm_per_px_x, 0.994 * STATED.mm_per_px_y, 0.2, -0.3, -1.2])
    errors = (values(found) - truth) / np.array([*truth[:2], 1, 1, 1])
    assert np.abs(errors[:2]).max() < 5e-4
    assert np.abs(errors[2:4]).max() < 1e-3
    assert abs(errors[4]) < 0.05
    assert found.left_mm < 0.002
    assert found.as_probe_camera()["distortion_ratio"] == pytest.approx(-0.012, abs=5e-4)


def test_recordings_of_one_grid_differ_in_cap_and_noise_alone(recordings):
    first, second = recordings.values()
    assert first.id != second.id
    assert first.camera == second.camera
    assert [frame.role for frame in first.frames] == [frame.role for frame in second.frames]
    assert not np.array_equal(first.frames[-1].counts, second.frames[-1].counts)


def test_all_that_keeps_a_camera_from_being_found_is_told_at_once(recordings):
    first, second = recordings.values()
    without = replace(second, frames=tuple(frame for frame in second.frames if frame.role != "reference"))
    with pytest.raises(InvalidRecord) as refused:
        camera_of({"a": first, "b": replace(without, serial="TSIS-0008")}, GridPrint(pitch_mm=3.0))
    assert [problem.quantity for problem in refused.value.problems] == [
        "b: serial",
        "a: distance of the grid's dots",
        "b: reference frames",
    ]


def test_a_recording_that_is_there_again_tells_nothing_more_and_is_refused(recordings):
    """Two names of one recording halved the stated errors."""
    with pytest.raises(InvalidRecord, match="recording of again is that of .* again, but must be another recording"):
        camera_of({**recordings, "again": next(iter(recordings.values()))}, GridPrint())


def as_if(recording, change):
    """Return a recording whose images are changed."""
    frames = tuple(replace(one, counts=np.ascontiguousarray(change(one.counts))) for one in recording.frames)
    return replace(recording, frames=frames)


CHANGES = {"shifted by 10 px": lambda counts: np.roll(counts, 10, axis=1), "turned": lambda counts: np.rot90(counts, 2)}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_a_recording_that_is_shifted_or_turned_is_refused_for_its_cap(recordings, change):
    """Of two, nothing tells which: it moved the axis by 0.15 mm, with a stated deviation of 0.014."""
    first, second = recordings.values()
    both = {"grid1": first, "grid2": as_if(second, change)}
    with pytest.raises(InvalidRecord) as refused:
        camera_of(both, GridPrint(), simulated_probe())
    assert [problem.quantity for problem in refused.value.problems] == ["cap of grid1", "cap of grid2"]
    assert camera_of(both, GridPrint(play_mm=0.3)).deviation[2] > 0.15


def test_of_four_caps_the_one_that_is_not_home_is_named(monkeypatch):
    middles = (0.02, 0.01), (-0.01, 0.02), (0.31, 0.0), (-0.02, -0.02)
    grids = iter([seen(30.0 * number, middle, 0.002, seed=number) for number, middle in enumerate(middles)])
    monkeypatch.setattr(camera_fit, "seen_grid", lambda recording, pitch_mm: next(grids))
    monkeypatch.setattr(camera_fit, "_of_one_camera", lambda recordings, probe: iter(()))
    monkeypatch.setattr(camera_fit, "given_again", lambda recordings, names: iter(()))
    camera = SimpleNamespace(camera=SimpleNamespace(scale=STATED))
    with pytest.raises(InvalidRecord) as refused:
        camera_of({f"grid{number}": camera for number in range(1, 5)}, GridPrint())
    assert str(refused.value) == (
        "cap of grid3 is 0.31 mm from the middle of all, but must be within 0.08 mm, 4 plays: "
        "put the cap home, record all in one orientation, or state --play-mm."
    )


def test_honest_caps_are_refused_in_less_than_three_of_a_thousand_fits():
    """Four caps of which each misses the middle by the play, drawn a hundred thousand times."""
    drawn = np.random.default_rng(3).standard_normal((100_000, 4, 2))
    aside = np.linalg.norm(drawn - np.median(drawn, axis=1, keepdims=True), axis=2)
    assert (aside.max(axis=1) > MOST_PLAYS).mean() < 3e-3


def test_pixels_of_another_pitch_than_the_printed_one_are_refused(recordings):
    with pytest.raises(InvalidRecord) as refused:
        camera_of(recordings, GridPrint(pitch_mm=2.1), simulated_probe())
    assert [problem.quantity for problem in refused.value.problems] == ["camera.mm_per_px_x", "camera.mm_per_px_y"]
    assert "name the pitch that is printed" in str(refused.value)


def test_without_recordings_there_is_no_camera():
    with pytest.raises(InvalidRecord, match="recordings is 0"):
        camera_of({}, GridPrint())
