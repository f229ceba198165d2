"""The surrogate's derivatives, what it takes out of the polynomials, and its file."""

import numpy as np
import pytest
from small_surrogate import COLUMNS, INCLUSION_COLUMNS, random_surrogate

from device.files.bundle_file import read_surrogate
from device.measurement.parameters import HIGH, LOW, PARAMETERS, denormalise, normalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.radial_profile import ROW_NAMES
from device.measurement.ramp_modes.surrogate import (
    ARRAYS,
    CONTRAST_COLUMNS,
    DEPTH,
    MODULUS,
    OFFSET,
    OFFSET_COLUMNS,
    SIZE,
    assemble,
    elastic_mismatch,
    inclusion_factor,
    polynomial_coordinates,
)


@pytest.fixture
def normalised() -> np.ndarray:
    return np.random.default_rng(1).uniform(-0.95, 0.95, (4, len(PARAMETERS)))


def test_the_jacobian_equals_central_differences(normalised):
    surrogate, step = random_surrogate(), 1e-5
    rows, jacobians = surrogate.rows_and_jacobian(normalised)
    np.testing.assert_allclose(rows, surrogate.rows(normalised), rtol=1e-12)
    for at, jacobian in zip(normalised, jacobians, strict=True):
        away = step * np.eye(len(PARAMETERS))
        differences = ((surrogate.rows(at + away) - surrogate.rows(at - away)) / (2 * step)).T
        np.testing.assert_allclose(jacobian, differences, atol=1e-6 * np.abs(differences).max())


def test_a_row_has_the_profiles_columns_in_the_profiles_order(normalised):
    assert random_surrogate().rows(normalised).shape == (len(normalised), len(ROW_NAMES))
    inclusion = np.arange(INCLUSION_COLUMNS)[None]
    row = assemble(inclusion, np.full((1, COLUMNS - INCLUSION_COLUMNS), -1.0))[0]
    kinds = np.array([name.split("_")[0] for name in ROW_NAMES])
    np.testing.assert_array_equal(row[kinds == "contrast"], inclusion[0, :CONTRAST_COLUMNS])
    np.testing.assert_array_equal(row[kinds == "growth"], -1.0)
    np.testing.assert_array_equal(row[kinds == "offset"], inclusion[0, CONTRAST_COLUMNS:])


def test_an_inclusions_strength_is_its_size_over_the_depth_of_its_middle_cubed():
    at = denormalise(np.zeros((1, len(PARAMETERS))))
    at[0, SIZE], at[0, DEPTH], at[0, OFFSET] = 6.0, 9.0, HIGH[OFFSET]
    np.testing.assert_allclose(inclusion_factor(at), 0.125, rtol=1e-14)
    at[0, OFFSET] = HIGH[OFFSET] / 4
    np.testing.assert_allclose(inclusion_factor(at)[0, CONTRAST_COLUMNS:], 0.125 / 4, rtol=1e-14)
    np.testing.assert_allclose(inclusion_factor(at)[0, :CONTRAST_COLUMNS], 0.125, rtol=1e-14)


def test_an_inclusion_on_the_axis_has_no_offset(normalised):
    normalised[:, OFFSET] = -1.0
    rows = random_surrogate().rows(normalised)
    np.testing.assert_array_equal(rows[:, -OFFSET_COLUMNS:], 0.0)
    assert np.abs(rows[:, :CONTRAST_COLUMNS]).min() > 0


def test_tissue_in_tissue_is_no_inclusion_and_a_rigid_sphere_has_mismatch_one():
    assert elastic_mismatch(np.array(5.0), np.array(5.0)) == 0
    assert elastic_mismatch(np.array(1e9), np.array(5.0)) == pytest.approx(1.0, abs=1e-7)


def test_the_modulus_coordinate_stays_inside_the_cube_and_touches_its_ends():
    tissue = PARAMETERS.index("tissue_modulus_kpa")
    corners = np.array([LOW, HIGH])
    corners[:, tissue] = HIGH[tissue], LOW[tissue]
    at = polynomial_coordinates(normalise(corners), corners)
    np.testing.assert_allclose(at[:, MODULUS], [-1, 1], atol=1e-13)


def test_a_saved_surrogate_comes_back_in_single_precision(normalised, tmp_path):
    surrogate, path = random_surrogate(), tmp_path / "surrogate.npz"
    np.savez(path, **surrogate.arrays())
    loaded = read_surrogate(path)
    np.testing.assert_array_equal(loaded.inclusion_field.degrees, surrogate.inclusion_field.degrees)
    np.testing.assert_array_equal(loaded.baseline.coefficients, surrogate.baseline.coefficients.astype(np.float32))
    rows = surrogate.rows(normalised)
    np.testing.assert_allclose(loaded.rows(normalised), rows, atol=1e-6 * np.abs(rows).max())


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(InvalidQuantity, match=r"^surrogate is .*absent\.npz"):
        read_surrogate(tmp_path / "absent.npz")


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 cut short"])
def test_a_garbled_file_is_refused_by_name(content, tmp_path):
    path = tmp_path / "garbled.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidQuantity, match=r"^surrogate is .*garbled\.npz"):
        read_surrogate(path)


def test_a_file_cut_off_or_changed_on_disk_is_refused_by_name(tmp_path):
    path = tmp_path / "changed.npz"
    np.savez(path, **random_surrogate().arrays())
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    for broken in (bytes(content), bytes(content[: len(content) // 2])):
        path.write_bytes(broken)
        with pytest.raises(InvalidQuantity, match=r"^surrogate is .*changed\.npz"):
            read_surrogate(path)


@pytest.mark.parametrize("name", ARRAYS)
def test_a_file_without_one_of_its_parts_or_with_one_of_another_shape_is_refused(name, tmp_path):
    path = tmp_path / "partial.npz"
    np.savez(path, **random_surrogate().arrays())
    with np.load(path) as file:
        parts = dict(file)
    np.savez(path, **{n: part for n, part in parts.items() if n != name})
    with pytest.raises(InvalidQuantity, match="^surrogate is"):
        read_surrogate(path)
    np.savez(path, **parts | {name: parts[name][:, :-1]})
    with pytest.raises(InvalidQuantity, match="^surrogate's shape is"):
        read_surrogate(path)
