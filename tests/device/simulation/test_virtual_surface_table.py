"""The table of surfaces: exact for polynomials, and refused when it is not what its description says."""

import json

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.surface_table import (
    SurfaceTable,
    barycentric_weights,
    chebyshev_points,
    load_surface_table,
)

R_MM = np.linspace(0.0, 11.0, 12)


def polynomial(size_mm, depth_mm, log_modulus):
    """A polynomial of degree 4, 3 and 2 in size, depth and ln E, different at every radius."""
    smooth = (1 + size_mm - 0.1 * size_mm**4) * (2 - depth_mm**3 / 50) * (log_modulus**2 - 3 * log_modulus)
    return np.multiply.outer(smooth, 1 + R_MM)


@pytest.fixture
def small_table():
    size, depth = chebyshev_points(0.0, 15.0, 5), chebyshev_points(4.0, 12.0, 4)
    modulus = np.array([40.0, np.sqrt(40.0 * 120.0), 120.0])  # Chebyshev points in the logarithm
    grid = np.meshgrid(size, depth, np.log(modulus), indexing="ij")
    return SurfaceTable(size, depth, modulus, R_MM, 0.4 + R_MM / 20, polynomial(*grid))


def test_chebyshev_points_ascend_from_end_to_end():
    """-cos(k pi / 4) on -1..1: -1, -0.7071, 0, 0.7071, 1."""
    half = np.sqrt(0.5)
    np.testing.assert_allclose(chebyshev_points(-1.0, 1.0, 5), [-1, -half, 0, half, 1], atol=1e-15)
    points = chebyshev_points(4.0, 12.0, 6)
    assert (points[0], points[-1]) == (4.0, 12.0)
    assert (np.diff(points) > 0).all()


@pytest.mark.parametrize("count", [2, 5, 8])
def test_interpolation_reproduces_polynomials_exactly(count):
    """n points carry any polynomial of degree n - 1."""
    points = chebyshev_points(-2.0, 3.0, count)
    coefficients = np.random.default_rng(count).normal(size=count)
    for at in np.linspace(-2.0, 3.0, 37):
        found = barycentric_weights(points, at) @ np.polyval(coefficients, points)
        assert found == pytest.approx(np.polyval(coefficients, at), rel=1e-10, abs=1e-10)


def test_weights_add_up_to_one_and_hit_a_point_exactly():
    points = chebyshev_points(0.0, 1.0, 6)
    assert barycentric_weights(points, 0.3).sum() == pytest.approx(1.0)
    np.testing.assert_array_equal(barycentric_weights(points, points[2]), np.eye(6)[2])


@pytest.mark.parametrize("inclusion", [(3.3, 7.7, 55.0), (15.0, 4.0, 120.0), (0.0, 12.0, 40.0), (9.0, 5.0, 99.0)])
def test_a_lump_field_is_interpolated_in_size_depth_and_log_modulus(small_table, inclusion):
    size, depth, modulus = inclusion
    expected = polynomial(size, depth, np.log(modulus))
    np.testing.assert_allclose(small_table.lump(Inclusion(*inclusion)), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("inclusion", "quantity"),
    [
        ((15.1, 6.0, 80.0), "size_mm"),
        ((10.0, 3.9, 80.0), "depth_mm"),
        ((10.0, 12.1, 80.0), "depth_mm"),
        ((10.0, 6.0, 39.0), "youngs_modulus_kpa"),
        ((10.0, 6.0, 121.0), "youngs_modulus_kpa"),
    ],
)
def test_an_inclusion_outside_the_table_is_refused_by_what_is_outside(small_table, inclusion, quantity):
    with pytest.raises(InvalidQuantity, match=f"^{quantity} is .*inside the table's range"):
        small_table.lump(Inclusion(*inclusion))


def test_the_committed_table_holds_every_corner_of_the_papers_box(table):
    for size_mm in (0.0, 15.0):
        for depth_mm in (4.0, 12.0):
            for modulus_kpa in (40.0, 120.0):
                assert np.isfinite(table.lump(Inclusion(size_mm, depth_mm, modulus_kpa))).all()


def test_a_table_comes_back_as_it_was_saved(small_table, tmp_path):
    small_table.save(tmp_path / "t", {"made_by": "a test"})
    found = load_surface_table(tmp_path / "t")
    for name in SurfaceTable.__dataclass_fields__:
        np.testing.assert_allclose(getattr(found, name), getattr(small_table, name), rtol=1e-6)
    assert json.loads((tmp_path / "t" / "surface_table.json").read_text())["made_by"] == "a test"


def test_a_table_with_one_changed_byte_is_refused(small_table, tmp_path):
    small_table.save(tmp_path, {})
    content = bytearray((tmp_path / "surface_table.npz").read_bytes())
    content[1000] ^= 1
    (tmp_path / "surface_table.npz").write_bytes(content)
    with pytest.raises(InvalidQuantity, match="^surface table's hash is [0-9a-f]{12}, but must be [0-9a-f]{12} as"):
        load_surface_table(tmp_path)


@pytest.mark.parametrize("file", ["surface_table.npz", "surface_table.json"])
def test_a_missing_file_is_refused_with_the_command_that_makes_it(small_table, tmp_path, file):
    small_table.save(tmp_path, {})
    (tmp_path / file).unlink()
    with pytest.raises(InvalidQuantity, match="host_tools table"):
        load_surface_table(tmp_path)


@pytest.mark.parametrize("text", ["{", "{}", "[]", '{"schema": "tsis.surface_table/2"}'])
def test_a_description_that_is_none_is_refused(small_table, tmp_path, text):
    small_table.save(tmp_path, {})
    (tmp_path / "surface_table.json").write_text(text)
    with pytest.raises(InvalidQuantity, match="^surface table"):
        load_surface_table(tmp_path)
