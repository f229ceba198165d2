"""The table of faces: exact for polynomials, and refused when it is not what its description says."""

import json

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.physics.chebyshev import points_inside, points_with_ends
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import SlabChanges
from device.simulation.physics.surface_table import OWN, SurfaceTable, load_surface_table

R_MM = np.linspace(0.0, 11.0, 12)
FORCE_N = points_inside(0.0, 0.8, 3)
SLAB_KPA, SLAB_MM = np.array([2.0, 5.0, 30.0]), np.array([15.0, 30.0, 60.0])
TERMS = np.array([[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0]], dtype=np.uint8)


def polynomial(size_mm, depth_mm, mismatch, force_n):
    """A polynomial of degree 2, 2, 2 and 2 in size, depth, mismatch and force, different at every radius."""
    smooth = (1 + size_mm - 0.1 * size_mm**2) * (2 - depth_mm**2 / 50) * (mismatch**2 - 3 * mismatch)
    return np.multiply.outer(smooth * (1 + force_n - 2 * force_n**2), 1 + R_MM)


def slab_effect(modulus_kpa, thickness_mm):
    """Linear in the logarithm of the modulus and in one over the squared thickness; none in the nominal slab."""
    stiffness, thinness = np.log(modulus_kpa / 5.0), thickness_mm**-2 - 30.0**-2
    return 2 * 0.25 * stiffness / np.log(15.0) + 2 * 0.5 * thinness / (15.0**-2 - 60.0**-2)


def effect_without_inclusion(modulus_kpa, thickness_mm):
    """Linear in the logarithm of the modulus and in one over the thickness; none in the nominal slab."""
    return 0.1 * np.log(modulus_kpa / 5.0) + 8 * (1 / thickness_mm - 1 / 30.0)


@pytest.fixture
def small_table():
    axes = points_with_ends(1.0, 15.0, 5), points_with_ends(4.0, 12.0, 5), points_with_ends(0.1, 0.96, 3)
    grid = np.meshgrid(*axes, FORCE_N, indexing="ij")
    baseline = np.stack([0.4 + R_MM / 20, 2 + R_MM])[:, None] * np.ones((3, 1))
    inclusion_field = np.stack([polynomial(*grid), 3 * polynomial(*grid)])
    baseline_change = np.multiply.outer(effect_without_inclusion(SLAB_KPA[:, None], SLAB_MM), baseline)
    shares = np.zeros((2, 5, 2))
    shares[0, 0], shares[1, 0] = 0.25, 0.5  # of the field itself
    return SurfaceTable(
        *axes,
        force_n=FORCE_N,
        r_mm=R_MM,
        bare_per_n=baseline,
        lump_per_n_mm3=inclusion_field,
        slabs=SlabChanges(SLAB_KPA, SLAB_MM, baseline_change.astype(np.float32), TERMS, shares, np.array(0.66)),
    )


@pytest.mark.parametrize("inclusion", [(3.3, 7.7, 55.0), (15.0, 4.0, 200.0), (1.0, 12.0, 8.0), (9.0, 5.0, 99.0)])
def test_an_inclusion_field_is_interpolated_in_size_depth_elastic_mismatch_and_force(small_table, inclusion):
    size, depth, modulus = inclusion
    face = small_table.inclusion_field(Inclusion(*inclusion)).at(0.37)
    mismatch = NOMINAL.elastic_mismatch(modulus)
    expected = 0.37 * size**3 * mismatch * polynomial(size, depth, mismatch, 0.37)
    np.testing.assert_allclose(face.w_mm, expected, rtol=1e-9)
    np.testing.assert_allclose(face.p_kpa, 3 * expected, rtol=1e-9)


@pytest.mark.parametrize("slab", [Slab(2.2, 17.0), Slab(6.25, 30.0), Slab(5.0, 60.0), Slab(28.0, 33.0)])
def test_another_slab_adds_its_change_at_the_same_elastic_mismatch_and_force(small_table, slab):
    ramps, size_mm = small_table.ramps(Inclusion(9.0, 5.0, 99.0), slab), 9.0
    mismatch, effect = slab.elastic_mismatch(99.0), slab_effect(slab.youngs_modulus_kpa, slab.thickness_mm)
    changed = (1 + effect) * size_mm**3 * mismatch * polynomial(size_mm, 5.0, mismatch, FORCE_N)
    np.testing.assert_allclose(ramps.inclusion_field.fields_per_n[0], changed, rtol=1e-6)
    np.testing.assert_allclose(ramps.inclusion_field.fields_per_n[1], 3 * changed, rtol=1e-6)
    without = 1 + effect_without_inclusion(slab.youngs_modulus_kpa, slab.thickness_mm)
    np.testing.assert_allclose(ramps.baseline.at(0.3).w_mm, without * 0.3 * (0.4 + R_MM / 20), rtol=1e-6)


def test_the_nominal_slab_has_no_change(small_table):
    inclusion = Inclusion(9.0, 5.0, 99.0)
    before, after = small_table.ramps(inclusion), small_table.ramps(inclusion, Slab(5.0, 30.0))
    np.testing.assert_array_equal(after.baseline.fields_per_n, small_table.bare_per_n)
    np.testing.assert_array_equal(after.inclusion_field.fields_per_n, before.inclusion_field.fields_per_n)


def test_an_inclusion_smaller_than_the_tables_smallest_shrinks_with_its_volume(small_table):
    small, smallest = (small_table.inclusion_field(Inclusion(d, 6.0, 80.0)).at(0.5).w_mm for d in (0.5, 1.0))
    np.testing.assert_allclose(small, smallest / 8, rtol=1e-9)
    assert not small_table.inclusion_field(Inclusion(0.0, 6.0, 80.0)).at(0.5).w_mm.any()


def test_beyond_the_largest_force_the_face_grows_in_proportion(small_table):
    ramp = small_table.inclusion_field(Inclusion(5.0, 6.0, 80.0))
    last = float(FORCE_N[-1])
    np.testing.assert_allclose(ramp.at(2 * last).w_mm, 2 * ramp.at(last).w_mm, rtol=1e-9)


def test_in_another_slab_the_face_grows_in_proportion_beyond_what_was_solved(small_table):
    for ramp in small_table.ramps(Inclusion(9.0, 5.0, 80.0), Slab(3.0, 40.0))[1:3]:
        np.testing.assert_allclose(ramp.at(0.78).p_kpa, 0.78 / 0.66 * ramp.at(0.66).p_kpa, rtol=1e-9)


def test_small_strain_is_the_smallest_force_in_proportion(small_table):
    ramp = small_table.inclusion_field(Inclusion(5.0, 6.0, 80.0))
    first = float(FORCE_N[0])
    np.testing.assert_allclose(ramp.at_small_strain(0.5).p_kpa, 0.5 / first * ramp.at(first).p_kpa, rtol=1e-9)


@pytest.mark.parametrize("slab", [NOMINAL, Slab(2.0, 28.0), Slab(30.0, 28.0), Slab(2.0, 60.0), Slab(30.0, 60.0)])
def test_the_committed_table_holds_every_corner_of_its_range_in_every_slab(table, slab):
    for size_mm in (0.0, 15.0):
        for depth_mm in (4.0, 12.0):
            for mismatch in (0.1, 0.96):
                ramps = table.ramps(Inclusion(size_mm, depth_mm, slab.modulus_kpa(mismatch)), slab)
                assert np.isfinite([ramp.at(0.5) for ramp in (ramps.baseline, ramps.inclusion_field)]).all()


def test_an_inclusion_outside_the_table_is_refused_in_its_slab(small_table):
    with pytest.raises(InvalidQuantity, match=r"^youngs_modulus_kpa is 7.9.*inside the table's range"):
        small_table.ramps(Inclusion(10.0, 6.0, 7.9), Slab(6.25))
    with pytest.raises(InvalidQuantity, match=r"^depth_mm \+ size_mm is 16.*thicker slab"):
        small_table.ramps(Inclusion(10.0, 6.0, 60.0), Slab(5.0, 16.5))


def test_a_table_comes_back_as_it_was_saved(small_table, tmp_path):
    small_table.save(tmp_path / "t", {"made_by": "a test"})
    found = load_surface_table(tmp_path / "t")
    for name in OWN:
        np.testing.assert_allclose(getattr(found, name), getattr(small_table, name), rtol=1e-6)
    for name in SlabChanges.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(found.slabs, name), getattr(small_table.slabs, name))
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


@pytest.mark.parametrize("text", ["{", "{}", "[]", '{"schema": "tsis.surface_table/3"}'])
def test_a_description_that_is_none_is_refused(small_table, tmp_path, text):
    small_table.save(tmp_path, {})
    (tmp_path / "surface_table.json").write_text(text)
    with pytest.raises(InvalidQuantity, match="^surface table"):
        load_surface_table(tmp_path)
