"""What a scan may be asked for, what it cannot have, and when it is there."""

import math
from dataclasses import replace

import pytest

from device.measurement.mode import MODES, ModeWorth
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.wanted_accuracy import UNTIL_BOUNDS, WITHIN_BOUND, WantedAccuracy

NOTHING = WantedAccuracy()
WORTH = ModeWorth(0.1, 0.9, {}, {}, {"size_mm": 0.8, "depth_mm": 0.5})


def test_every_unknown_can_be_asked_for_up_to_its_bound():
    assert tuple(UNTIL_BOUNDS) == UNKNOWNS
    for name, bound in UNTIL_BOUNDS.items():
        assert WantedAccuracy({name: bound.high}).until == {name: bound.high}
        with pytest.raises(InvalidQuantity, match=rf"^until\.{name} is .* at most {bound.high:g} {bound.unit}"):
            WantedAccuracy({name: math.nextafter(bound.high, math.inf)})


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, True, "1", None, 10**400])
@pytest.mark.parametrize("name", UNKNOWNS)
def test_what_is_no_width_is_refused_with_the_range(name, value):
    with pytest.raises(InvalidQuantity, match=rf"^until\.{name} is .* above 0 and at most {UNTIL_BOUNDS[name].high:g}"):
        WantedAccuracy({name: value})


def test_what_is_no_unknown_is_refused_with_those_there_are():
    with pytest.raises(InvalidQuantity, match="'tissue_modulus_kpa', but must be of size_mm, depth_mm, youngs_modul"):
        WantedAccuracy({"tissue_modulus_kpa": 1.0})


@pytest.mark.parametrize("seconds", [4.999, 300.1, math.nan, True, "30"])
def test_a_time_is_five_to_three_hundred_seconds(seconds):
    assert (WITHIN_BOUND.low, WITHIN_BOUND.high) == (5.0, 300.0)
    with pytest.raises(InvalidQuantity, match=r"^within_s is .* at least 5 and at most 300 s"):
        WantedAccuracy({}, seconds)


@pytest.mark.parametrize("mode", [mode for mode in MODES if mode != "precise"])
@pytest.mark.parametrize("wanted", [WantedAccuracy({"size_mm": 1.0}), WantedAccuracy({}, 30.0)])
def test_only_a_scan_can_be_asked_for_it(mode, wanted):
    NOTHING.require_for(mode, None, 3.0)
    with pytest.raises(InvalidQuantity, match=f"asked for in mode {mode}, but must be asked for in mode precise"):
        wanted.require_for(mode, None, 3.0)


def test_what_cannot_be_reached_is_refused_with_the_nearest_and_what_nobody_knows_is_taken():
    WantedAccuracy({"size_mm": 0.8, "youngs_modulus_kpa": 0.001}).require_for("precise", WORTH, 3.0)
    WantedAccuracy({"size_mm": 0.001}).require_for("precise", None, 3.0)
    WantedAccuracy({"size_mm": 0.001}).require_for("precise", ModeWorth(0.1, 0.9, {}, {}), 3.0)
    with pytest.raises(InvalidQuantity, match=r"until\.size_mm is 0\.79, .* at least 0\.8 .* be had is 0\.8 mm"):
        WantedAccuracy({"size_mm": 0.79}).require_for("precise", WORTH, 3.0)


def test_with_a_time_it_must_be_there_in_as_many_presses_as_there_is_time_for():
    """Presses of 10 s: the third is under way when 25 s are over, and a fourth when 30 s are."""
    widths = {2: {"size_mm": (2.0, 3.0)}, 3: {"size_mm": (1.5, 2.0)}, 4: {"size_mm": (0.7, 1.0)}}
    worth = replace(WORTH, half_width_by_ramps=widths)
    WantedAccuracy({"size_mm": 1.5, "depth_mm": 0.5}, 25.0).require_for("precise", worth, 10.0)
    WantedAccuracy({"size_mm": 0.8}, 30.0).require_for("precise", worth, 10.0)
    WantedAccuracy({"size_mm": 0.8}, 300.0).require_for("precise", worth, 10.0)
    WantedAccuracy({"size_mm": 0.8}).require_for("precise", worth, 10.0)
    with pytest.raises(InvalidQuantity, match=r"is 1\.49, .* at least 1\.5 .* be had within 25 s is 1\.5 mm"):
        WantedAccuracy({"size_mm": 1.49}, 25.0).require_for("precise", worth, 10.0)
    with pytest.raises(InvalidQuantity, match=r"at least 2 and .* within 5 s is 2 mm"):
        WantedAccuracy({"size_mm": 1.9}, 5.0).require_for("precise", worth, 10.0)
    with pytest.raises(InvalidQuantity, match=r"at least 0\.8 and .* within 30 s is 0\.8 mm"):
        WantedAccuracy({"size_mm": 0.79}, 30.0).require_for("precise", worth, 10.0)


def test_it_is_reached_when_all_that_was_asked_for_is_and_nothing_is_not_reached_by_anything():
    wanted = WantedAccuracy({"size_mm": 1.0, "depth_mm": 0.5})
    assert wanted.is_reached({"size_mm": 1.0, "depth_mm": 0.5, "youngs_modulus_kpa": 99.0}) is True
    assert wanted.is_reached({"size_mm": 1.0, "depth_mm": 0.51}) is False
    assert wanted.is_reached({"size_mm": 0.1}) is False
    assert wanted.is_reached({"size_mm": 0.1, "depth_mm": math.nan}) is False
    assert WantedAccuracy({}, 30.0).is_reached({"size_mm": 0.1}) is None
