"""The table of faces: exact for polynomials, and refused when it is not what its description says."""

import json

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.chebyshev import points_inside, points_with_ends
from device.simulation.surface_table import SurfaceTable, load_surface_table

R_MM = np.linspace(0.0, 11.0, 12)
FORCE_N = points_inside(0.0, 0.8, 3)


def polynomial(size_mm, depth_mm, log_modulus, force_n):
    """A polynomial of degree 4, 3, 2 and 2 in size, depth, ln E and force, different at every radius."""
    smooth = (1 + size_mm - 0.1 * size_mm**4) * (2 - depth_mm**3 / 50) * (log_modulus**2 - 3 * log_modulus)
    return np.multiply.outer(smooth * (1 + force_n - 2 * force_n**2), 1 + R_MM)


def pressure(*of):
    return polynomial(*of) * 3


@pytest.fixture
def small_table():
    size, depth = points_with_ends(1.0, 15.0, 5), points_with_ends(4.0, 12.0, 4)
    modulus = np.array([40.0, np.sqrt(40.0 * 120.0), 120.0])  # Chebyshev points in the logarithm
    grid = np.meshgrid(size, depth, np.log(modulus), FORCE_N, indexing="ij")
    bare = np.stack([0.4 + R_MM / 20, 2 + R_MM]) * np.ones((3, 1, 1))
    lump = np.stack([polynomial(*grid), pressure(*grid)])
    return SurfaceTable(size, depth, modulus, FORCE_N, R_MM, np.swapaxes(bare, 0, 1), lump)


@pytest.mark.parametrize("inclusion", [(3.3, 7.7, 55.0), (15.0, 4.0, 120.0), (1.0, 12.0, 40.0), (9.0, 5.0, 99.0)])
def test_a_lump_field_is_interpolated_in_size_depth_modulus_and_force(small_table, inclusion):
    size, depth, modulus = inclusion
    face = small_table.lump(Inclusion(*inclusion)).at(0.37)
    scale = 0.37 * size**3
    np.testing.assert_allclose(face.w_mm, scale * polynomial(size, depth, np.log(modulus), 0.37), rtol=1e-9)
    np.testing.assert_allclose(face.p_kpa, scale * pressure(size, depth, np.log(modulus), 0.37), rtol=1e-9)


def test_a_lump_smaller_than_the_tables_smallest_shrinks_with_its_volume(small_table):
    small, smallest = (small_table.lump(Inclusion(d, 6.0, 80.0)).at(0.5).w_mm for d in (0.5, 1.0))
    np.testing.assert_allclose(small, smallest / 8, rtol=1e-9)
    assert not small_table.lump(Inclusion(0.0, 6.0, 80.0)).at(0.5).w_mm.any()


def test_beyond_the_largest_force_the_face_grows_in_proportion(small_table):
    ramp = small_table.lump(Inclusion(5.0, 6.0, 80.0))
    last = float(FORCE_N[-1])
    np.testing.assert_allclose(ramp.at(2 * last).w_mm, 2 * ramp.at(last).w_mm, rtol=1e-9)


def test_small_strain_is_the_smallest_force_in_proportion(small_table):
    ramp = small_table.lump(Inclusion(5.0, 6.0, 80.0))
    first = float(FORCE_N[0])
    np.testing.assert_allclose(ramp.at_small_strain(0.5).p_kpa, 0.5 / first * ramp.at(first).p_kpa, rtol=1e-9)


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
                face = table.lump(Inclusion(size_mm, depth_mm, modulus_kpa)).at(0.5)
                assert np.isfinite(face).all()


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


@pytest.mark.parametrize("text", ["{", "{}", "[]", '{"schema": "tsis.surface_table/1"}'])
def test_a_description_that_is_none_is_refused(small_table, tmp_path, text):
    small_table.save(tmp_path, {})
    (tmp_path / "surface_table.json").write_text(text)
    with pytest.raises(InvalidQuantity, match="^surface table"):
        load_surface_table(tmp_path)
