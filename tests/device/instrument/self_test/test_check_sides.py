"""Which half is brighter when a side is lit alone, in made-up images: +x is right, +y is down."""

import numpy as np
import pytest

from device.instrument.self_test.checks import side_results, untested_sides
from device.measurement.recording.led_sides import SIDES

DARK = np.full((40, 60), 4.0)
FULL = (0.6, 0.6, 0.6, 0.6)


def lit_from(side, light=30.0, touch=1.0):
    """Return counts that fall by a third from a side to the opposite one, on a contact `touch` [40, 60]."""
    y, x = np.mgrid[-1:1:40j, -1:1:60j]
    towards = {"+x": x, "+y": y, "-x": -x, "-y": -y}[side]
    return DARK + light * (1 + 0.4 * towards) * touch


def judge(sides, **options):
    return {
        result.check: result for result in side_results(DARK, [lit_from(side, **options) for side in sides], FULL, 0.3)
    }


def test_each_side_that_lights_its_own_half_passes():
    """The mean of 1 + 0.4 x over a half is 1.2, over the opposite 0.8."""
    results = judge(SIDES)
    assert [result.verdict for result in results.values()] == ["passed"] * 4
    assert [result.value for result in results.values()] == pytest.approx([1.5] * 4, rel=0.02)


def test_where_the_block_touches_does_not_matter():
    """A contact in the right lower corner only: all sides seem to light it."""
    touch = np.zeros((40, 60))
    touch[12:, 20:] = 1.0
    assert [result.verdict for result in judge(SIDES, touch=touch).values()] == ["passed"] * 4


@pytest.mark.parametrize(
    ("order", "failed"),
    [
        (("-x", "+y", "+x", "-y"), {"LED +x": "-x", "LED -x": "+x"}),
        (("+y", "+x", "-x", "-y"), {"LED +x": "+y", "LED +y": "+x"}),
    ],
)
def test_swapped_plugs_are_named_both(order, failed):
    results = judge(order)
    assert {name for name, result in results.items() if result.verdict == "failed"} == set(failed)
    for name, side in failed.items():
        assert f"It lights {side}" in results[name].remedy


def test_a_dead_side_is_named_and_the_others_pass():
    images = [lit_from(side) for side in SIDES]
    images[1] = DARK
    results = {result.check: result for result in side_results(DARK, images, FULL, 0.3)}
    assert {name: result.verdict for name, result in results.items() if result.verdict == "failed"} == {
        "LED +y": "failed"
    }
    assert (results["LED +y"].value, results["LED +y"].unit) == (0.0, "counts")
    assert "gives no light" in results["LED +y"].remedy


def test_without_any_light_every_side_fails():
    results = side_results(DARK, [DARK] * 4, FULL, 0.3)
    assert [result.verdict for result in results] == ["failed"] * 4


def test_a_side_that_is_set_dimmer_is_not_taken_for_a_dark_one():
    images = [lit_from("+x", light=7.5), *(lit_from(side) for side in SIDES[1:])]
    results = side_results(DARK, images, (0.15, 0.6, 0.6, 0.6), 0.3)
    assert [result.verdict for result in results] == ["passed"] * 4


def test_sides_that_were_not_tested_say_what_it_takes():
    results = untested_sides()
    assert [(result.check, result.verdict) for result in results] == [(f"LED {side}", "not_tested") for side in SIDES]
    assert all("reference block" in result.remedy for result in results)
