"""Random presses are recorded where and as often as a mode asks, each with a seed of its own."""

import numpy as np
import pytest

from device.measurement.mode import FRAMES, MODES, RAMP_FROM_N, RAMP_TO_N, mode_of
from device.measurement.parameters import NOMINAL, PARAMETERS
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import COLUMNS, CONTRAST, RESPONSE, press_profile
from device.measurement.recording.recording import Recording
from device.simulation.physics.neighbour import Neighbour
from device.simulation.physics.skin import Skin
from host_tools.calibration.phantom import TARGET_N, UNLOADED_FRAMES
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.recorded_presses import (
    RecordedPresses,
    direction_of_press_rad,
    in_parallel,
    protocol_of,
    record_presses,
    recorded_press,
    scenario_of,
)

INCLUSION = np.array([12.0, 6.0, 60.0, *(NOMINAL | {"offset_mm": 1.5}).values()])


@pytest.fixture(scope="module")
def recording(tables) -> Recording:
    return recorded_press(tables, INCLUSION, "standard", seed=5)


@pytest.mark.parametrize("mode", MODES)
def test_a_modes_protocol_takes_its_frames_over_the_ramp_or_at_one_force(mode):
    protocol = protocol_of(mode, 0.0, 0.0)
    assert len(protocol.forces_n) * protocol.frames == FRAMES[mode].count
    if FRAMES[mode].is_ramp:
        assert (min(protocol.forces_n), max(protocol.forces_n)) == pytest.approx((RAMP_FROM_N, RAMP_TO_N))
        assert mode_of(protocol.forces_n, FRAMES[mode].fewest_ramps) == mode
    else:
        assert set(protocol.forces_n) == {TARGET_N}


def test_the_probe_stands_beside_the_inclusion_by_the_offset_at_the_angle():
    place = protocol_of("standard", 1.5, np.pi / 6).place
    assert (place.x_mm, place.y_mm) == pytest.approx((1.5 * np.sqrt(3) / 2, 0.75))


def test_a_recording_has_the_modes_frames_on_the_lesion_and_beside_it(recording):
    counts = [len(recording.with_role(role)) for role in ("dark", "reference", "press")]
    assert counts == [UNLOADED_FRAMES, UNLOADED_FRAMES + FRAMES["standard"].count, FRAMES["standard"].count]
    assert mode_of([frame.force_n for frame in recording.with_role("press")]) == "standard"
    assert recording.truth == Inclusion(12.0, 6.0, 60.0)
    assert np.hypot(*recording.position_mm) == pytest.approx(1.5)


def test_every_press_is_pressed_from_another_side(tables, recording):
    other = recorded_press(tables, INCLUSION, "quick", seed=6)
    assert np.hypot(*other.position_mm) == pytest.approx(1.5)
    assert np.hypot(*np.subtract(other.position_mm, recording.position_mm)) > 0.01


def test_the_direction_of_a_press_is_known_from_its_seed_and_seen_in_its_frames(recording):
    """From either side, for the face looks the same after half a turn; noise turns what is seen by some degrees."""
    direction_rad = direction_of_press_rad(5)
    assert recording.position_mm == pytest.approx((1.5 * np.cos(direction_rad), 1.5 * np.sin(direction_rad)))
    assert np.cos(2 * (press_profile(recording).direction_rad - direction_rad)) > 0.97
    assert direction_of_press_rad(5) == direction_rad != direction_of_press_rad(6)


def test_parameters_become_skin_and_slab_of_the_scenario_by_their_names():
    parameters = draw_parameters(1, np.random.default_rng(1))[0]
    at = dict(zip(PARAMETERS, parameters, strict=True))
    neighbour = Neighbour(x_mm=11.0)
    scenario = scenario_of(parameters, neighbour, wet_ratio=0.3)
    assert (scenario.tissue_modulus_kpa, scenario.slab_thickness_mm) == (
        at["tissue_modulus_kpa"],
        at["slab_thickness_mm"],
    )
    skin = Skin(
        albedo=at["albedo"],
        spread_mm=at["spread_mm"],
        contact_pressure_kpa=at["contact_pressure_kpa"],
        wet_ratio=0.3,
    )
    assert (scenario.skin, scenario.neighbour) == (skin, neighbour)


def test_drift_of_light_and_cell_is_in_the_press_frames_alone(tables, recording):
    levels = ErrorLevels(gain_ratio=0.05, zero_n=0.01, model_ratio=0.0)
    made = recorded_press(tables, INCLUSION, "standard", seed=5, levels=levels)
    assert made.position_mm == recording.position_mm
    for role in ("dark", "reference"):
        for frame, found in zip(recording.with_role(role), made.with_role(role), strict=True):
            assert found.force_n == frame.force_n
            np.testing.assert_array_equal(found.counts, frame.counts)
    pairs = list(zip(recording.with_role("press"), made.with_role("press"), strict=True))
    moved_n = [found.force_n - frame.force_n for frame, found in pairs]
    assert moved_n == pytest.approx([moved_n[0]] * len(pairs))
    assert moved_n[0] != 0
    assert all((found.counts != frame.counts).any() for frame, found in pairs)


def test_rows_and_second_harmonics_are_those_of_each_press_alone_with_its_own_seed(tables):
    """So they are the same whoever takes which of them."""
    parameters = np.array([INCLUSION, [8.0, 5.0, 120.0, *NOMINAL.values()]])
    found = record_presses(tables, parameters, "standard", seed=3, jobs=1)
    for number, one in enumerate(parameters):
        profile = press_profile(recorded_press(tables, one, "standard", 300_000 + number))
        np.testing.assert_array_equal(found.rows[number], profile.as_row()[None])
        np.testing.assert_array_equal(found.rows[number], found.seen[number].rows)
        np.testing.assert_array_equal(found.seen[number].second_harmonics, profile.second_harmonic[None])
        assert found.seen[number].direction_rad.tolist() == [profile.direction_rad]
    assert found.parameters is parameters


def test_presses_of_one_inclusion_differ_by_noise_alone(tables):
    """Other hand, camera noise and side of the offset; the contrast in the middle keeps within a tenth of its peak."""
    rows = record_presses(tables, np.array([INCLUSION, INCLUSION]), "standard", seed=4, jobs=1).rows
    (first,), (second,) = rows
    assert (first != second).all()
    np.testing.assert_allclose(first[:11], second[:11], atol=0.1 * first[:11].max())


FURTHER_MM = [np.array([4.0]), np.array([6.0, 3.0])]


@pytest.fixture(scope="module")
def scans(tables) -> RecordedPresses:
    parameters = np.array([INCLUSION, INCLUSION])
    return record_presses(tables, parameters, "precise", seed=3, further_mm=FURTHER_MM, jobs=1)


def test_a_scan_has_a_row_and_second_harmonics_for_every_ramp(scans):
    assert [rows.shape for rows in scans.rows] == [(2, COLUMNS), (3, COLUMNS)]
    assert [len(one.second_harmonics) for one in scans.seen] == [2, 3]
    assert [len(np.unique(one.direction_rad)) for one in scans.seen] == [2, 3]


def test_ramps_of_a_scan_have_one_reference_and_see_the_inclusion_from_their_own_places(scans):
    """The further aside, the fainter the middle."""
    rows = scans.rows[1]
    np.testing.assert_array_equal(rows[1:, RESPONSE], np.tile(rows[0, RESPONSE], (2, 1)))
    middle = rows[:, CONTRAST.start]
    assert middle[0] > middle[2] > middle[1]


def test_further_ramps_leave_the_first_one_as_it_is_alone(tables, scans):
    """The same hand, side and noise of the camera: its frames are taken first."""
    alone = record_presses(tables, INCLUSION[None], "precise", seed=3, jobs=1)
    np.testing.assert_array_equal(scans.rows[0][0], alone.rows[0][0])


def test_a_scans_frames_are_numbered_by_their_ramps_each_at_its_own_offset(tables):
    recording = recorded_press(tables, INCLUSION, "precise", seed=5, further_mm=(4.0, 6.0))
    ramps = recording.ramps()
    assert list(ramps) == [0, 1, 2]
    assert {len(frames) for frames in ramps.values()} == {FRAMES["precise"].count}
    assert np.hypot(*recording.position_mm) == pytest.approx(1.5)


def test_results_come_in_the_order_of_the_numbers():
    assert in_parallel(lambda number: number**2, 6, jobs=1) == [0, 1, 4, 9, 16, 25]
