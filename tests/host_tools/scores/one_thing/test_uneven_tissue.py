"""Layers of tissue that are solved anew: how they are drawn, what a press sees of them, and a chapter of a few."""

import numpy as np
import pytest

from device.files.bundle_file import read_quick_model, read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import Inclusion
from device.simulation.physics.slab import Slab
from device.simulation.physics.world import World
from host_tools.press_models.press_derivatives import load_derivatives
from host_tools.probe_tables.force_ramps import TissueStack
from host_tools.scores.one_thing.press_answers import TOLERANT, DesignToTry
from host_tools.scores.one_thing.solved_layers import aside_in_layers, in_layers
from host_tools.scores.one_thing.uneven_tissue import EVEN, UnevenTissue, pressed_in, stacks_of, uneven_tissue_chapter

SLAB, INCLUSION = Slab(6.0, 32.0), Inclusion(11.0, 6.0, 90.0)
OTHER, ALIKE = UnevenTissue(0.2), UnevenTissue(0.2, is_alike_beside=True)


@pytest.fixture
def design(tables):
    quick, derivatives = read_quick_model(MODELS / "quick"), load_derivatives(SIMULATED_PROBE)
    return DesignToTry(read_ramp_model(MODELS / "standard"), quick, derivatives, tables)


def test_a_stack_is_layers_of_the_slab_from_the_surface_down():
    tissue = TissueStack((4.0, 4.0), (1.5, 0.5, 2.0)).scene(SLAB, INCLUSION).tissue
    assert [(one.thickness_mm, one.youngs_modulus_kpa) for one in tissue.stack] == [(4, 9), (4, 3), (24, 12)]
    assert TissueStack((4.0,), (1.5, 0.5)).evened() == TissueStack((4.0,), (1.0, 1.0))


def test_layers_beside_are_others_unless_they_are_alike():
    (over, beside), (again, alike), (even, _) = (
        stacks_of(kind, SLAB, np.random.default_rng(3)) for kind in (OTHER, ALIKE, EVEN)
    )
    assert over == again == alike
    assert over != beside
    assert even.is_even
    assert not over.is_even
    assert len(over.modulus_ratio) == 7
    assert (OTHER.words, ALIKE.words) == ("uneven by 20 %, other beside", "uneven by 20 %, alike beside")


def test_drawn_layers_have_the_spread_that_is_stated():
    rng = np.random.default_rng(1)
    logs = np.log([stacks_of(OTHER, SLAB, rng)[0].modulus_ratio for _ in range(800)])
    assert logs.std() == pytest.approx(0.2 * 0.96, rel=0.02), "what lies beyond two deviations is at two"


def test_in_thin_slabs_no_layer_reaches_the_base_and_deep_tissue_is_below_8_mm():
    over, _ = stacks_of(UnevenTissue(0.0, deep_ratio=2.0), Slab(6.0, 15.0), np.random.default_rng(1))
    assert over == TissueStack((4.0, 4.0, 4.0), (1.0, 1.0, 2.0, 2.0))


@pytest.mark.long
def test_stiff_tissue_over_the_lesion_darkens_what_is_seen_of_a_press_without_an_inclusion(design):
    """Even tissue shows nothing; layers that are alike beside next to nothing; others beside a contrast."""
    parameters = np.array([11.0, 6.0, 90.0, 6.0, 32.0, 2.0, 0.5, 1.0, 0.1])
    kinds = EVEN, ALIKE, UnevenTissue(0.3)
    even, alike, other = (
        np.abs(one.single.without.rows[0][:40]).max()
        for one in pressed_in(design, parameters, kinds=kinds, seed=[3, 1])
    )
    assert alike < 2 * even < other


@pytest.mark.long
def test_layers_like_the_slab_change_nothing_and_a_stiffer_stack_bears_the_force_on_less_depth(tables):
    as_tabled = tables.ramps(INCLUSION, SLAB, World())
    even, stiff = in_layers(
        as_tabled, SLAB, INCLUSION, [TissueStack((4.0,), (1.0, 1.0)), TissueStack((4.0,), (2.0, 2.0))]
    )
    assert even is as_tabled
    twice = tables.ramps(Inclusion(11.0, 6.0, 90.0), Slab(12.0, 32.0), World())
    changed, tabled = (of.baseline.fields_per_n[0] - as_tabled.baseline.fields_per_n[0] for of in (stiff, twice))
    assert np.linalg.norm(changed - tabled) < 0.1 * np.linalg.norm(tabled)


@pytest.mark.long
def test_aside_too_a_stack_of_one_modulus_is_what_the_table_has_in_tissue_as_stiff(tables):
    """Of what a slab twice as stiff changes of modes off the rim; where it is not pressed the table holds."""
    table, at_mm = tables.off_axis, 3.5
    stacks = [TissueStack((4.0,), (1.0, 1.0)), TissueStack((4.0,), (2.0, 2.0))]
    even, stiff = aside_in_layers(table, SLAB, INCLUSION, at_mm, stacks)
    assert even is table
    before, after = (of.modes(INCLUSION, at_mm, SLAB)[..., :-3] for of in (table, stiff))
    tabled = table.modes(INCLUSION, at_mm, Slab(12.0, 32.0))[..., :-3]
    for changed, as_tabled in zip(after - before, tabled - before, strict=True):
        assert np.linalg.norm(changed - as_tabled) < 0.1 * np.linalg.norm(as_tabled)
    np.testing.assert_array_equal(stiff.modes(INCLUSION, 20.0, SLAB), table.modes(INCLUSION, 20.0, SLAB))


@pytest.mark.long
def test_a_press_and_a_scan_become_two_tables(design):
    chapter = uneven_tissue_chapter(design, presses=1, scans=1, kinds=(EVEN, OTHER), seed=2, jobs=1)
    on_inclusions, without = chapter.tables
    rows = ["even", OTHER.words, "even, scans of two", f"{OTHER.words}, scans of two"]
    assert [row[:2] for row in on_inclusions.rows] == [(words, TOLERANT) for words in rows]
    assert [row[:2] for row in without.rows] == [(words, "1") for words in rows]
    assert "presses without an inclusion that have numbers" in {one.quantity for one in chapter.benchmarks}
