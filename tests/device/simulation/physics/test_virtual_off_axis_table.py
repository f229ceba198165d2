"""What another slab changes of a field off the axis: nothing in the nominal one, its shares of shapes elsewhere."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import points_with_ends
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.off_axis_table import (
    COSINES,
    OWN,
    AsideChanges,
    OffAxisTable,
    aside_shapes,
    load_off_axis_table,
)
from device.simulation.physics.slab import NOMINAL, Slab

AXES = InclusionAxes(points_with_ends(2.0, 15.0, 5), points_with_ends(4.0, 12.0, 4), np.array([0.1, 0.96]))
OFFSET_MM, R_MM, MODES = points_with_ends(2.0, 16.0, 5), np.linspace(0.0, 11.0, 6), 4
TERMS = np.array([[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0], [1, 0, 1, 0, 0, 1]], dtype=np.uint8)
PLACE = Inclusion(7.0, 5.5, 60.0)
FIRM = Slab(12.0, 24.0)


def field(size_mm, depth_mm, mismatch, offset_mm):
    """Over force, size cubed and mismatch: of degree 2 in size and offset, 1 in depth and mismatch; [..., K, R]."""
    of_place = (1 + 0.1 * size_mm - 0.004 * size_mm**2) * (1 - 0.03 * depth_mm) * (1 + 0.2 * mismatch)
    return np.multiply.outer(
        of_place * (2 - 0.1 * offset_mm + 0.001 * offset_mm**2), np.outer(0.5 ** np.arange(MODES), 1 + R_MM)
    )


def effects(slab, size_mm=7.0, offset_mm=9.0):
    """Of the mean, the first cosine and the others: linear in ln Et, there also with size and offset, and in 1/T^2."""
    stiffness, thinness = np.log(slab.youngs_modulus_kpa / 5.0), slab.thickness_mm**-2 - 30.0**-2
    with_place = 0.25 * (2 * (size_mm - 1) / 14 - 1) * (2 * (offset_mm - 2) / 14 - 1)
    return [
        2 * (share + with_place) * stiffness / np.log(15.0) + 2 * 0.5 * thinness / (15.0**-2 - 60.0**-2)
        for share in (0.1, 0.2, 0.3)
    ]


@pytest.fixture
def table():
    shares = np.zeros((3, 3, 5, 2))
    shares[:, 0, 0], shares[:, 1, 0], shares[:, 2, 0] = np.array([[0.1], [0.2], [0.3]]), 0.5, 0.25  # of the field
    grid = np.meshgrid(*AXES, OFFSET_MM, indexing="ij")
    tilts = np.array([2.0, 30.0]), np.array([15.0, 60.0]), np.ones((2, 2, 2, len(R_MM)))
    slabs = AsideChanges(TERMS, shares.astype(np.float32))
    return OffAxisTable(*AXES, OFFSET_MM, R_MM, np.stack([field(*grid), 3 * field(*grid)]), *tilts, slabs)


def test_in_the_nominal_slab_modes_are_interpolated(table):
    mismatch = NOMINAL.elastic_mismatch(60.0)
    expected = 7.0**3 * mismatch * field(7.0, 5.5, mismatch, 9.0)
    np.testing.assert_allclose(table.modes(PLACE, 9.0), [expected, 3 * expected], rtol=1e-9)


@pytest.mark.parametrize("slab", [Slab(2.2, 17.0), FIRM, Slab(28.0, 60.0), NOMINAL.changed(0.9)])
@pytest.mark.parametrize(("size_mm", "offset_mm"), [(7.0, 9.0), (12.0, 4.0)])
def test_another_slab_adds_its_share_of_each_kind_of_cosine_at_the_same_mismatch(table, slab, size_mm, offset_mm):
    mismatch = slab.elastic_mismatch(60.0)
    nominal = size_mm**3 * mismatch * field(size_mm, 5.5, mismatch, offset_mm)
    found = table.modes(replace(PLACE, size_mm=size_mm), offset_mm, slab)
    for of_cosines, effect in zip(COSINES, effects(slab, size_mm, offset_mm), strict=True):
        np.testing.assert_allclose(found[0, of_cosines], (1 + effect) * nominal[of_cosines], rtol=1e-6)
        np.testing.assert_allclose(found[1, of_cosines], 3 * (1 + effect) * nominal[of_cosines], rtol=1e-6)


def test_the_growth_with_a_slab_is_that_of_all_its_modes(table):
    """At the table's nearest offset; none in the nominal slab, and at the table's end nothing is refused."""
    now, before = table.modes(PLACE, 9.0, FIRM), table._in_nominal_slab(PLACE, 9.0, FIRM)
    expected = np.sqrt((now**2).sum(axis=(1, 2)) / (before**2).sum(axis=(1, 2)))
    np.testing.assert_allclose(table.growth_with(FIRM, PLACE, 9.0), expected, rtol=1e-9)
    np.testing.assert_array_equal(table.growth_with(NOMINAL, PLACE, 9.0), 1.0)
    np.testing.assert_array_equal(table.growth_with(FIRM, PLACE, 0.3), table.growth_with(FIRM, PLACE, 2.0))
    np.testing.assert_array_equal(table.growth_with(FIRM, replace(PLACE, size_mm=0.0), 9.0), 1.0)
    assert np.isfinite(table.growth_with(NOMINAL.changed(0.9), replace(PLACE, youngs_modulus_kpa=304.0), 9.0)).all()


def test_a_slab_that_is_all_but_nominal_changes_all_but_nothing(table):
    nominal, near = table.modes(PLACE, 5.0), table.modes(replace(PLACE, youngs_modulus_kpa=60.012), 5.0, Slab(5.001))
    np.testing.assert_allclose(near, nominal, rtol=2e-4)


def test_shapes_are_the_field_and_how_it_grows():
    """Against differences of the field on paper; the last is wider, by the squared radius."""
    grid = np.meshgrid(*AXES, OFFSET_MM, indexing="ij")
    per_n_mm3 = np.stack([field(*grid), 3 * field(*grid)])
    mismatch = FIRM.elastic_mismatch(60.0)

    def added(size_mm=7.0, depth_mm=5.5, offset_mm=9.0):
        return size_mm**3 * mismatch * field(size_mm, depth_mm, mismatch, offset_mm)

    shapes = aside_shapes(AXES, per_n_mm3, OFFSET_MM, PLACE, 9.0, FIRM)
    by_size = 7.0 * (added(size_mm=7.001) - added(size_mm=6.999)) / 0.002
    by_depth, by_offset = added(depth_mm=6.0) - added(depth_mm=5.0), (added(offset_mm=9.5) - added(offset_mm=8.5))
    expected = [added(), by_size, by_depth, by_offset, added() * np.linspace(0, 1, len(R_MM)) ** 2]
    for found, one in zip(shapes, expected, strict=True):
        np.testing.assert_allclose(found, [one, 3 * one], rtol=1e-5)


def test_an_inclusion_smaller_than_the_smallest_changes_as_that_one(table):
    small, smallest = (table.modes(replace(PLACE, size_mm=size_mm), 5.0, FIRM) for size_mm in (1.0, 2.0))
    np.testing.assert_allclose(small, smallest / 8, rtol=1e-9)
    assert not table.modes(replace(PLACE, size_mm=0.0), 5.0, FIRM).any()


def test_a_table_comes_back_from_its_file_with_what_slabs_change(table, tmp_path):
    table.save(tmp_path, {})
    found = load_off_axis_table(tmp_path)
    np.testing.assert_allclose(found.modes(PLACE, 9.0, FIRM), table.modes(PLACE, 9.0, FIRM), rtol=1e-5)
    assert set(OWN) | {"slabs"} == set(OffAxisTable.__dataclass_fields__)
