"""Which block is named of what: how it is counted, and a chapter of a few things from presses to its table."""

from collections import Counter

import numpy as np
import pytest

from device.files.bundle_file import read_quick_model, read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.ramp_modes.misfit_blocks import BLOCKS, BlockMisfit
from host_tools.press_models.press_derivatives import load_derivatives
from host_tools.scores.one_thing.causes import causes_to_name
from host_tools.scores.one_thing.named_blocks import (
    GEL,
    HEADER,
    TWO,
    NamedBlocks,
    _benchmarks,
    _cells,
    _medians,
    named_blocks_chapter,
)
from host_tools.scores.one_thing.press_answers import SHIPPED, TOLERANT, DesignToTry


def named(refused=0, ratio=1.0, **counts):
    of_presses = [{block: BlockMisfit(ratio * 40, 40) for block in BLOCKS}]
    return NamedBlocks(
        9, refused, Counter({None if one == "none" else one: n for one, n in counts.items()}), of_presses
    )


def test_every_block_has_things_of_it_and_one_thing_is_of_several():
    things = causes_to_name()
    assert {one.block for one in things} == {*BLOCKS, None}
    assert len({one.cause.name for one in things}) == len(things)


def test_two_opposite_leds_are_a_pair_whichever_it_is():
    (cause,) = (one.cause for one in causes_to_name() if one.block == "second_harmonic")
    pairs = {cause.worlds(np.random.default_rng(seed))[0].light.lesion_side_ratio for seed in range(8)}
    assert pairs == {(0.9, 1.0, 0.9, 1.0), (1.0, 0.9, 1.0, 0.9)}


def test_a_row_counts_what_is_named_and_says_nothing_where_nothing_is_refused():
    assert _cells(named(5, contrast=3, none=2), "contrast") == ("9", "5", "3", "0", "0", "0", "2", "contrast")
    assert _cells(named(), None) == ("9", "0", "", "", "", "", "", "several")


def test_the_share_of_right_names_is_of_all_that_is_refused():
    found = {"one": [("contrast", named(6, contrast=6)), ("first_harmonic", named(4, contrast=3, first_harmonic=1))]}
    (benchmark,) = _benchmarks(found)
    assert benchmark.measured == pytest.approx(0.7)
    assert not benchmark.passed


def test_medians_are_of_each_block_over_its_columns():
    assert _medians({"one": named(ratio=1.1), "other": named(ratio=0.5)}).rows == (
        ("one", "9", *["1.10"] * 4),
        ("other", "9", *["0.50"] * 4),
    )


@pytest.mark.long
@pytest.mark.study
def test_a_few_things_become_a_table(tables):
    design = DesignToTry(
        read_ramp_model(MODELS / "standard"),
        read_quick_model(MODELS / "quick"),
        load_derivatives(SIMULATED_PROBE),
        tables,
    )
    chosen = {"exponent of the contact law 0.9", "tilt on the lesion 0.5 degrees", "wetting over the lesion +50 %"}
    things = [one for one in causes_to_name() if one.cause.name in chosen]
    chapter = named_blocks_chapter(design, presses=2, recorded=2, things=things, jobs=1)
    table, answered, medians = chapter.tables
    assert [row[:2] for row in answered.rows] == [(thing, by) for thing in (TWO, GEL) for by in (SHIPPED, TOLERANT)]
    assert [row[0] for row in medians.rows] == [SHIPPED, TOLERANT]
    assert table.header == HEADER
    assert [row[0] for row in table.rows[::2]] == [*(one.cause.quantity for one in things), TWO, GEL]
    assert [row[2] for row in table.rows] == [SHIPPED, TOLERANT] * 5
    right = 5 + np.array([BLOCKS.index(one.block) for one in things])
    for row, column in zip(table.rows[:6:2], right, strict=True):
        assert row[column] == row[4] != "0"
    assert chapter.benchmarks[0].passed
