"""The surrogate's derivatives, what it takes out of the polynomials, and its file."""

from dataclasses import replace

import numpy as np
import pytest
from small_surrogate import COLUMNS, REACH_MM, random_scan_surrogate, random_surrogate, white_noise

from device.files.bundle_file import read_ramp_answers
from device.measurement.parameters import ELASTIC_MISMATCHES, HIGH, LOW, PARAMETERS, denormalise, normalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.model import SURROGATE_ARRAYS, surrogate_arrays
from device.measurement.ramp_modes.radial_profile import CONTRAST, FIRST, RESPONSE, SECOND
from device.measurement.ramp_modes.surrogate import (
    CONTRAST_COLUMNS,
    DEPTH,
    FIRST_COLUMNS,
    INCLUSION_COLUMNS,
    MODULUS,
    OFFSET,
    RESPONSE_COLUMNS,
    SIZE,
    TISSUE,
    WAVES,
    assemble,
    direction_waves,
    elastic_mismatch,
    inclusion_factor,
    offsets_in_range,
    polynomial_coordinates,
    surrogate_of,
    turned,
)


@pytest.fixture
def normalised() -> np.ndarray:
    return np.random.default_rng(1).uniform(-0.95, 0.95, (4, len(PARAMETERS)))


def assert_jacobians_are_central_differences(surrogate, normalised, direction_rad, step=1e-5):
    rows, jacobians = surrogate.rows_and_jacobian(normalised, direction_rad)
    np.testing.assert_allclose(rows, surrogate.rows(normalised, direction_rad), rtol=1e-12)
    away = step * np.eye(len(PARAMETERS))
    for number, (at, jacobian) in enumerate(zip(normalised, jacobians, strict=True)):
        own = None if direction_rad is None else np.repeat(direction_rad[number], len(PARAMETERS))
        differences = ((surrogate.rows(at + away, own) - surrogate.rows(at - away, own)) / (2 * step)).T
        np.testing.assert_allclose(jacobian, differences, atol=1e-6 * np.abs(differences).max())


DIRECTIONS = np.array([0.3, -2.0, np.nan, 1.1])


@pytest.mark.parametrize("direction_rad", [None, DIRECTIONS], ids=["any", "told"])
def test_the_jacobian_equals_central_differences(normalised, direction_rad):
    assert_jacobians_are_central_differences(random_surrogate(), normalised, direction_rad)


@pytest.mark.parametrize("direction_rad", [None, DIRECTIONS], ids=["any", "told"])
def test_a_scans_jacobian_equals_central_differences_near_and_beside(normalised, direction_rad):
    normalised[2:, OFFSET] = 2 * np.array([3.0, 7.5]) / HIGH[OFFSET] - 1
    assert_jacobians_are_central_differences(random_scan_surrogate(), normalised, direction_rad)


def test_a_press_of_a_scan_is_of_the_surrogate_that_holds_its_offset(normalised):
    """Up to 2 mm the near one, that end itself included; beyond the one beside."""
    surrogate = random_scan_surrogate()
    assert surrogate.to_mm == REACH_MM
    for offset_mm, holds in ((0.5, surrogate.near), (2.0, surrogate.near), (2.01, surrogate.beside)):
        normalised[:, OFFSET] = 2 * offset_mm / HIGH[OFFSET] - 1
        np.testing.assert_array_equal(surrogate.rows(normalised), holds.rows(normalised))


def test_each_press_of_a_scan_lies_in_its_own_direction(normalised):
    surrogate = random_scan_surrogate()
    normalised[:, OFFSET] = 2 * np.array([1.0, 7.0, 0.5, 4.0]) / HIGH[OFFSET] - 1
    together = surrogate.rows(normalised, DIRECTIONS)
    for number, row in enumerate(together):
        holds = (surrogate.near, surrogate.beside)[number % 2]
        alone = holds.rows(normalised[[number]], DIRECTIONS[[number]])[0]
        np.testing.assert_allclose(row, alone, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("make", [random_surrogate, random_scan_surrogate])
def test_rows_without_a_direction_are_the_mean_over_all_directions(make, normalised):
    """Eight even directions, wherever they begin, hold as many crests as troughs of both waves."""
    surrogate = make()
    normalised[2:, OFFSET] = 2 * np.array([1.9, 4.0]) / HIGH[OFFSET] - 1
    everywhere = 0.4 + np.pi / 4 * np.arange(8)
    rows = [surrogate.rows(normalised, np.full(len(normalised), direction)) for direction in everywhere]
    expected = surrogate.rows(normalised)
    assert (rows[0] != expected)[:, CONTRAST].all()
    np.testing.assert_allclose(np.mean(rows, axis=0), expected, atol=1e-12 * np.abs(rows).max())


def of_one_wave(order):
    """Return a random surrogate in which only the wave of this order adds anything."""
    surrogate = random_surrogate()
    field = surrogate.turned_field
    other = np.repeat(order != WAVES, INCLUSION_COLUMNS)
    return replace(surrogate, turned_field=replace(field, coefficients=np.where(other, 0.0, field.coefficients)))


@pytest.mark.parametrize(
    ("order", "turn_rad", "times"),
    [
        (2, np.pi / 2, -1.0),
        (2, np.pi, 1.0),
        (4, np.pi / 4, -1.0),
        (4, np.pi / 2, 1.0),
        (2, np.pi / 6, 0.5),
        (4, np.pi / 12, 0.5),
    ],
)
def test_a_turn_flips_a_wave_after_half_of_its_length_and_leaves_it_after_the_whole(normalised, order, turn_rad, times):
    """The frame's edges come back after half a turn, four LEDs after a quarter; from the crest, both fall as cos."""
    surrogate, along = of_one_wave(order), np.zeros(len(normalised))
    mean = surrogate.rows(normalised)
    crest = surrogate.rows(normalised, along) - mean
    assert np.abs(crest[:, CONTRAST]).min() > 0
    for turned_by in (turn_rad, -turn_rad):
        found = surrogate.rows(normalised, along + turned_by) - mean
        np.testing.assert_allclose(found, times * crest, atol=1e-12 * np.abs(crest).max())


def test_what_a_direction_adds_is_as_strong_as_the_inclusion_and_nothing_of_the_reference(normalised):
    surrogate, directions = random_surrogate(), np.full(len(normalised), 0.3)
    parameters = denormalise(normalised)
    at = surrogate.coordinates(normalised, parameters)
    waves = np.split(surrogate.turned_field.values(at), len(WAVES), axis=1)
    expected = inclusion_factor(parameters) * (np.cos(0.6) * waves[0] + np.cos(1.2) * waves[1])
    added = surrogate.rows(normalised, directions) - surrogate.rows(normalised)
    np.testing.assert_array_equal(added[:, RESPONSE], 0.0)
    np.testing.assert_allclose(added, assemble(expected, np.zeros((len(at), RESPONSE_COLUMNS))), atol=1e-12)


def test_a_direction_that_is_no_number_adds_nothing(normalised):
    surrogate, unknown = random_surrogate(), np.full(len(normalised), np.nan)
    found, slopes = surrogate.rows_and_jacobian(normalised, unknown)
    np.testing.assert_array_equal(surrogate.rows(normalised, unknown), surrogate.rows(normalised))
    expected, expected_slopes = surrogate.rows_and_jacobian(normalised)
    np.testing.assert_array_equal(found, expected)
    np.testing.assert_array_equal(slopes, expected_slopes)
    told = surrogate.rows(normalised, np.array([0.2, np.nan, 0.2, np.nan]))
    np.testing.assert_array_equal(told[1::2], expected[1::2])
    assert (told[::2, CONTRAST] != expected[::2, CONTRAST]).all()


def test_waves_of_a_direction_are_its_cosines():
    directions = np.array([0.0, np.pi / 4, np.pi / 2, np.pi / 8, np.nan])
    half = np.sqrt(0.5)
    expected = [[1, 1], [0, -1], [-1, 1], [half, 0], [0, 0]]
    np.testing.assert_allclose(direction_waves(directions), expected, atol=1e-15)
    waves = np.arange(2 * 5 * 6, dtype=float).reshape(2, 5, 6)
    added = turned(waves, directions)
    assert added.shape == (2, 5, 3)
    np.testing.assert_allclose(added[:, 1], -waves[:, 1, 3:], atol=1e-14)
    np.testing.assert_allclose(added[:, 2], waves[:, 2, 3:] - waves[:, 2, :3], atol=1e-14)


def test_an_offset_runs_from_end_to_end_of_its_own_range():
    """Coordinates of `normalise` are those of 0 to 2 mm: 2, 5 and 8 mm are 1, 4 and 7."""
    at = np.zeros((3, len(PARAMETERS)))
    at[:, OFFSET] = 1.0, 4.0, 7.0
    moved = offsets_in_range(at, 2.0, 8.0)
    np.testing.assert_allclose(moved[:, OFFSET], [-1.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_array_equal(np.delete(moved, OFFSET, axis=1), 0.0)
    np.testing.assert_array_equal(at[:, OFFSET], [1.0, 4.0, 7.0])


def test_a_row_has_the_profiles_columns_in_the_profiles_order(normalised):
    assert random_surrogate().rows(normalised).shape == (len(normalised), COLUMNS)
    inclusion = np.arange(INCLUSION_COLUMNS)[None]
    row = assemble(inclusion, np.full((1, RESPONSE_COLUMNS), -1.0))[0]
    np.testing.assert_array_equal(row[CONTRAST], inclusion[0, :CONTRAST_COLUMNS])
    np.testing.assert_array_equal(row[RESPONSE], -1.0)
    np.testing.assert_array_equal(row[FIRST], inclusion[0, CONTRAST_COLUMNS : CONTRAST_COLUMNS + FIRST_COLUMNS])
    np.testing.assert_array_equal(row[SECOND], inclusion[0, CONTRAST_COLUMNS + FIRST_COLUMNS :])


def test_an_inclusions_strength_is_its_size_over_the_depth_of_its_middle_cubed():
    """Harmonics also grow as the offset and its square."""
    at = denormalise(np.zeros((1, len(PARAMETERS))))
    at[0, SIZE], at[0, DEPTH], at[0, OFFSET] = 6.0, 9.0, HIGH[OFFSET]
    np.testing.assert_allclose(inclusion_factor(at), 0.125, rtol=1e-14)
    at[0, OFFSET] = HIGH[OFFSET] / 4
    contrast, first, second = np.split(inclusion_factor(at)[0], [CONTRAST_COLUMNS, CONTRAST_COLUMNS + FIRST_COLUMNS])
    np.testing.assert_allclose(contrast, 0.125, rtol=1e-14)
    np.testing.assert_allclose(first, 0.125 / 4, rtol=1e-14)
    np.testing.assert_allclose(second, 0.125 / 16, rtol=1e-14)


def test_an_inclusion_on_the_axis_has_no_harmonics(normalised):
    normalised[:, OFFSET] = -1.0
    rows = random_surrogate().rows(normalised)
    np.testing.assert_array_equal(rows[:, FIRST.start :], 0.0)
    assert np.abs(rows[:, CONTRAST]).min() > 0


def test_tissue_in_tissue_is_no_inclusion_and_a_rigid_sphere_has_mismatch_one():
    assert elastic_mismatch(np.array(5.0), np.array(5.0)) == 0
    assert elastic_mismatch(np.array(1e9), np.array(5.0)) == pytest.approx(1.0, abs=1e-7)


def test_the_modulus_coordinate_stays_inside_the_cube_and_touches_its_ends():
    corners = np.array([LOW, HIGH])
    corners[:, MODULUS] = [5.0 * (1 + 1.5 * mismatch) / (1 - mismatch) for mismatch in ELASTIC_MISMATCHES]
    corners[:, TISSUE] = 5.0
    at = polynomial_coordinates(normalise(corners), corners)
    np.testing.assert_allclose(at[:, MODULUS], [-1, 1], atol=1e-13)


@pytest.fixture(scope="module")
def answers() -> RampAnswers:
    return RampAnswers(random_scan_surrogate(), white_noise(1e-3))


def test_saved_surrogates_come_back_in_single_precision_and_the_cameras_noise_exactly(normalised, answers, tmp_path):
    path = tmp_path / "surrogate.npz"
    np.savez(path, **surrogate_arrays(answers))
    loaded = read_ramp_answers(path)
    normalised[2:, OFFSET] = 2 * np.array([3.0, 7.5]) / HIGH[OFFSET] - 1
    rows = answers.surrogate.rows(normalised, DIRECTIONS)
    np.testing.assert_allclose(loaded.surrogate.rows(normalised, DIRECTIONS), rows, atol=1e-6 * np.abs(rows).max())
    for part, saved in zip(("near", "beside"), (answers.surrogate.near, answers.surrogate.beside), strict=True):
        found = getattr(loaded.surrogate, part)
        assert (found.from_mm, found.to_mm) == (saved.from_mm, saved.to_mm)
        np.testing.assert_array_equal(found.inclusion_field.degrees, saved.inclusion_field.degrees)
        np.testing.assert_array_equal(found.turned_field.degrees, saved.turned_field.degrees)
        turned_coefficients = saved.turned_field.coefficients.astype(np.float32)
        np.testing.assert_array_equal(found.turned_field.coefficients, turned_coefficients)
        np.testing.assert_array_equal(found.baseline.coefficients, saved.baseline.coefficients.astype(np.float32))
    np.testing.assert_array_equal(loaded.noise.camera, answers.noise.camera)


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(InvalidQuantity, match=r"^surrogate is .*absent\.npz"):
        read_ramp_answers(tmp_path / "absent.npz")


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 cut short"])
def test_a_garbled_file_is_refused_by_name(content, tmp_path):
    path = tmp_path / "garbled.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidQuantity, match=r"^surrogate is .*garbled\.npz"):
        read_ramp_answers(path)


def test_a_file_cut_off_or_changed_on_disk_is_refused_by_name(answers, tmp_path):
    path = tmp_path / "changed.npz"
    np.savez(path, **surrogate_arrays(answers))
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    for broken in (bytes(content), bytes(content[: len(content) // 2])):
        path.write_bytes(broken)
        with pytest.raises(InvalidQuantity, match=r"^surrogate is .*changed\.npz"):
            read_ramp_answers(path)


@pytest.mark.parametrize("name", SURROGATE_ARRAYS)
def test_a_file_without_one_of_its_parts_is_refused(name, answers, tmp_path):
    path = tmp_path / "partial.npz"
    np.savez(path, **{n: part for n, part in surrogate_arrays(answers).items() if n != name})
    with pytest.raises(InvalidQuantity, match="^surrogate is"):
        read_ramp_answers(path)


@pytest.mark.parametrize("name", [name for name in SURROGATE_ARRAYS if name != "to_mm"])
def test_a_file_with_a_part_of_another_shape_is_refused(name, answers, tmp_path):
    path, parts = tmp_path / "partial.npz", surrogate_arrays(answers)
    np.savez(path, **parts | {name: parts[name][:, :-1]})
    of_noise = {"camera": "shape of the camera's noise", "forward": "shape of the forward model's error"}
    named = of_noise.get(name, "surrogate's shape")
    with pytest.raises(InvalidQuantity, match=f"^{named} is"):
        read_ramp_answers(path)


def test_a_turned_field_of_one_wave_alone_is_refused():
    """As many numbers as the inclusion's own field has, and not twice that."""
    arrays = random_surrogate().arrays()
    one = {"turned_coefficients": arrays["turned_coefficients"][:, :INCLUSION_COLUMNS]}
    expected = rf"\(7, {len(WAVES) * INCLUSION_COLUMNS}\)"
    with pytest.raises(InvalidQuantity, match=rf"^surrogate's shape is \(7, {INCLUSION_COLUMNS}\), .*{expected}"):
        surrogate_of(arrays | one)


@pytest.mark.parametrize("to_mm", [np.array([8.0, 9.0]), np.array(np.nan), np.array(1.5)])
def test_a_file_whose_largest_offset_is_none_is_refused(to_mm, answers, tmp_path):
    path = tmp_path / "partial.npz"
    np.savez(path, **surrogate_arrays(answers) | {"to_mm": to_mm})
    with pytest.raises(InvalidQuantity, match="largest offset"):
        read_ramp_answers(path)
