"""The table around the trained ranges, of fields that are known on paper instead of solved ones."""

import numpy as np
import pytest

from device.measurement.parameters import ABOVE_BASE_MM, RANGES
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.ramp_modes.surrogate import far_field_strength
from device.simulation.physics.slab import NOMINAL, Slab
from host_tools.probe_tables import out_of_range_table
from host_tools.probe_tables.out_of_range_table import (
    ASIDE_MM,
    ASIDE_POINTS,
    POINTS,
    SHALLOWEST_MM,
    SIZES_MM,
    SMALLEST_ASIDE_MM,
    WideTable,
    axes,
    build_wide_table,
    deepest_mm,
    depth_at,
    load_wide_table,
    nearest,
)
from host_tools.scores.just_outside import INCLUSIONS

FEW, FEW_ASIDE = (3, 4, 2), (2, 3, 2)
LARGE_AND_DEEP = Inclusion(14.0, 14.5, 60.0)


def of_place(size_mm: float, depth_mm: float, mismatch: float) -> float:
    """A field over force, strength and mismatch that is linear in size, mismatch and the share of the depth."""
    share = (depth_mm - SHALLOWEST_MM) / (deepest_mm(size_mm) - SHALLOWEST_MM)
    return 1.0 + 0.1 * size_mm + mismatch + 0.4 * share


def over_volume(size_mm: float, depth_mm: float, mismatch: float) -> float:
    return of_place(size_mm, depth_mm, mismatch) * far_field_strength(size_mm, depth_mm) / size_mm**3


@pytest.fixture
def built(monkeypatch, tables) -> WideTable:
    """Fields of all radii alike; pressure twice the deformation, in place of solves."""
    forces, radii = tables.centred.lump_per_n_mm3.shape[-2:]
    modes, aside_radii = tables.off_axis.lump_per_n_mm3.shape[-2:]

    def centred(scene_of, slab, levels, size_mm, depth_mm, mismatches):
        assert slab == NOMINAL
        ones = np.multiply.outer([1.0, 2.0], np.ones((forces, radii)))
        return np.array([over_volume(size_mm, depth_mm, mismatch) * ones for mismatch in mismatches])

    def aside(size_mm, depth_mm, offset_mm, mismatches):
        assert offset_mm == ASIDE_MM
        ones = np.multiply.outer([1.0, 2.0], np.ones((modes, aside_radii)))
        return np.array([over_volume(size_mm, depth_mm, mismatch) * ones for mismatch in mismatches])

    monkeypatch.setattr(out_of_range_table, "centred_per_n_mm3", centred)
    monkeypatch.setattr(out_of_range_table, "inclusions_per_n_mm3", aside)
    monkeypatch.setattr(out_of_range_table, "POINTS", FEW)
    monkeypatch.setattr(out_of_range_table, "ASIDE_POINTS", FEW_ASIDE)
    return build_wide_table(points=FEW, aside_points=FEW_ASIDE, jobs=1)


def test_it_reaches_every_side_of_the_trained_ranges_and_every_inclusion_that_is_measured():
    assert SIZES_MM[0] < RANGES["size_mm"].low
    assert SIZES_MM[1] > RANGES["size_mm"].high
    assert RANGES["depth_mm"].low > SHALLOWEST_MM
    for one in INCLUSIONS:
        assert SIZES_MM[0] <= one.size_mm <= SIZES_MM[1]
        assert SHALLOWEST_MM <= one.depth_mm <= deepest_mm(one.size_mm)
    assert deepest_mm(RANGES["size_mm"].high) > RANGES["depth_mm"].high


def test_no_inclusion_touches_the_base_of_the_nominal_slab():
    sizes_mm = np.linspace(*SIZES_MM, 50)
    deepest = np.array([deepest_mm(size) for size in sizes_mm])
    assert (sizes_mm + deepest < NOMINAL.thickness_mm - 0.5).all()
    assert (np.diff(deepest) < 0).all()


def test_points_include_the_ends():
    for points in (POINTS, ASIDE_POINTS):
        found = axes(points, 1.5)
        assert [len(one) for one in found] == list(points)
        assert (found.size_mm[0], found.size_mm[-1]) == (1.5, SIZES_MM[1])
        assert (found.depth_share[0], found.depth_share[-1]) == (0.0, 1.0)


INSIDE = Inclusion(7.0, 5.0, 60.0)
OUTSIDE = (LARGE_AND_DEEP, Inclusion(0.5, 3.2, 20.0), Inclusion(17.0, 6.0, 150.0), Inclusion(5.0, 13.0, 60.0))


def on_paper(one: Inclusion, slab: Slab = NOMINAL) -> float:
    size_mm, depth_mm, modulus_kpa = one.as_tuple()
    mismatch = slab.elastic_mismatch(modulus_kpa)
    return of_smallest(one, SIZES_MM[0], mismatch) * far_field_strength(size_mm, depth_mm) * mismatch


def of_smallest(one: Inclusion, smallest_mm: float, mismatch: float) -> float:
    """A smaller inclusion than the smallest has its field at the same share of its own depths."""
    share = (one.depth_mm - SHALLOWEST_MM) / (deepest_mm(one.size_mm) - SHALLOWEST_MM)
    size_mm = max(one.size_mm, smallest_mm)
    return of_place(size_mm, depth_at(size_mm, share), mismatch)


@pytest.mark.parametrize("slab", [NOMINAL, Slab(5.5, 28.0)])
def test_an_inclusion_inside_is_the_probes_own(built, tables, slab):
    wide = built.around(tables)
    found, expected = (table.inclusion_field(INSIDE, slab).fields_per_n for table in (wide.centred, tables.centred))
    np.testing.assert_array_equal(found, expected)
    found, expected = (table.modes(INSIDE, 1.0, slab) for table in (wide.off_axis, tables.off_axis))
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("one", OUTSIDE)
@pytest.mark.parametrize("slab", [NOMINAL, Slab(5.5, 32.0)])
def test_beyond_the_probes_own_table_the_wide_fields_carry_it_on(built, tables, one, slab):
    """From the nearest inclusion inside, as strong as far away; pressure is twice the deformation on paper."""
    near = nearest(one, tables.centred, slab)
    ratio = far_field_strength(one.size_mm, one.depth_mm) / far_field_strength(near.size_mm, near.depth_mm)
    gained = on_paper(one, slab) - ratio * on_paper(near, slab)
    expected = (
        ratio * tables.centred.inclusion_field(near, slab).fields_per_n + gained * np.array([1.0, 2.0])[:, None, None]
    )
    found = built.around(tables).centred.inclusion_field(one, slab)
    np.testing.assert_allclose(found.fields_per_n, expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_array_equal(found.force_n, tables.centred.inclusion_field(near, slab).force_n)


@pytest.mark.parametrize("one", OUTSIDE)
@pytest.mark.parametrize("slab", [NOMINAL, Slab(5.5, 28.0)])
def test_an_inclusion_beside_the_axis_is_carried_on_likewise(built, tables, one, slab):
    near = nearest(one, tables.off_axis, slab)
    ratio = far_field_strength(one.size_mm, one.depth_mm) / far_field_strength(near.size_mm, near.depth_mm)
    scaled = [
        of_smallest(one, SMALLEST_ASIDE_MM, slab.elastic_mismatch(one.youngs_modulus_kpa))
        * far_field_strength(one.size_mm, one.depth_mm)
        * slab.elastic_mismatch(one.youngs_modulus_kpa)
        for one in (one, near)
    ]
    gained = (scaled[0] - ratio * scaled[1]) * np.array([1.0, 2.0])[:, None, None]
    expected = ratio * tables.off_axis.modes(near, ASIDE_MM, slab) + gained
    found = built.around(tables).off_axis.modes(one, ASIDE_MM, slab)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9)


def test_in_a_thin_slab_the_nearest_inclusion_lies_above_the_base_as_well(built, tables):
    """Nearest in depth alone it would go through: a large one 3 mm deep, where the probe's own table begins at 4 mm."""
    one, thin = Inclusion(11.0, 3.0, 60.0), Slab(5.0, 15.05)
    near = nearest(one, tables.centred, thin)
    assert (near.size_mm, near.depth_mm) == (pytest.approx(15.05 - ABOVE_BASE_MM - 4.0), 4.0)
    assert np.isfinite(built.around(tables).centred.inclusion_field(one, thin).fields_per_n).all()
    assert nearest(one, tables.centred, NOMINAL).size_mm == one.size_mm


def test_an_inclusion_through_the_base_of_a_thin_slab_is_refused(built, tables):
    with pytest.raises(InvalidQuantity, match=r"^depth_mm \+ size_mm is 18\.0, .* at most 15 mm"):
        built.around(tables).centred.inclusion_field(Inclusion(6.0, 12.0, 60.0), Slab(5.0, 16.0))


def test_nothing_jumps_at_the_ends_of_the_probes_own_table(built, tables):
    wide = built.around(tables).centred
    for end, beyond in (((15.0, 6.0), (15.0001, 6.0)), ((8.0, 4.0), (8.0, 3.9999)), ((8.0, 12.0), (8.0, 12.0001))):
        at, after = (wide.inclusion_field(Inclusion(*place, 60.0)).fields_per_n for place in (end, beyond))
        np.testing.assert_allclose(after, at, atol=1e-3 * np.abs(at).max())


def test_nearer_the_axis_an_inclusion_fades_into_the_centred_one_as_in_the_probes_own_table(built, tables):
    wide, own = built.around(tables).off_axis, tables.off_axis
    for table, one in ((wide, LARGE_AND_DEEP), (own, INSIDE)):
        half, whole = table.modes(one, ASIDE_MM / 2), table.modes(one, ASIDE_MM)
        np.testing.assert_allclose(half[:, 1], whole[:, 1] / 2)
        np.testing.assert_allclose(half[:, 0], whole[:, 0] / 4)
    assert wide.centred_share(1.0) == own.centred_share(1.0)


def test_without_an_inclusion_the_face_is_the_probes_own(built, tables):
    for slab in (NOMINAL, Slab(4.5, 32.0)):
        found, expected = (table.ramps(Inclusion(8.0, 6.0, 60.0), slab).baseline for table in (
            built.around(tables).centred, tables.centred))  # fmt: skip
        np.testing.assert_array_equal(found.fields_per_n, expected.fields_per_n)


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (Inclusion(19.0, 6.0, 60.0), "size_mm is 19"),
        (Inclusion(8.0, 2.5, 60.0), "depth_mm is 2.5"),
        (Inclusion(16.0, 14.0, 60.0), "depth_mm is 14"),
    ],
)
def test_an_inclusion_that_it_does_not_hold_is_refused(built, tables, one, words):
    with pytest.raises(InvalidQuantity, match=words):
        built.around(tables).centred.ramps(one)


def test_an_inclusion_farther_beside_than_was_solved_is_refused(built, tables):
    with pytest.raises(InvalidQuantity, match="offset_mm is 3"):
        built.around(tables).off_axis.modes(LARGE_AND_DEEP, 3.0)


def test_a_file_gives_it_back_and_a_changed_one_is_refused(built, tmp_path):
    built.save(tmp_path)
    again = load_wide_table(tmp_path)
    np.testing.assert_allclose(again.centred, built.centred, rtol=1e-6)
    np.testing.assert_allclose(again.aside, built.aside, rtol=1e-6)
    assert RANGES["offset_mm"].high <= ASIDE_MM
    content = bytearray((tmp_path / "wide_table.npz").read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "wide_table.npz").write_bytes(content)
    with pytest.raises(InvalidQuantity, match="hash"):
        load_wide_table(tmp_path)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("SIZES_MM", (1.2, 19.0), "wide table's inclusions_sha256"),
        ("DEEPEST_MM", 18.0, "wide table's inclusions_sha256"),
        ("POINTS", (3, 5, 2), "wide table's inclusions_sha256"),
        ("ASIDE_MM", 3.0, "wide table's aside_mm is 2.0, but must be 3.0"),
    ],
)
def test_a_table_that_was_made_for_other_inclusions_is_refused(built, tmp_path, monkeypatch, name, value, words):
    built.save(tmp_path)
    monkeypatch.setattr(out_of_range_table, name, value)
    with pytest.raises(InvalidQuantity, match=words):
        load_wide_table(tmp_path)
