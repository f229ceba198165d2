"""Faults on the clock of a test: when they are there, and what they make of light, bus and clock."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from device.measurement.quantities import InvalidQuantity
from device.simulation.faults import NO_FAULTS, FaultTimeline, ScriptedFault

LIT = (0.6, 0.5, 0.4, 0.3)


class Clock:
    """Shows what a test sets."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.mark.parametrize(
    ("t_s", "is_active"), [(99.0, False), (102.9, False), (103.0, True), (104.9, True), (105.0, False)]
)
def test_a_fault_counts_from_the_start_of_the_simulation(clock, t_s, is_active):
    faults = FaultTimeline([ScriptedFault("camera_stall", from_s=3.0, until_s=5.0)], clock=clock)
    assert faults.is_active("camera_stall", t_s) is is_active
    assert not faults.is_active("camera_torn", t_s)
    clock.now_s = t_s
    assert faults.is_active("camera_stall") is is_active


def test_a_fault_of_a_press_waits_for_that_press(clock):
    faults = FaultTimeline([ScriptedFault("cell_silent", from_s=1.0, from_press=2)], clock=clock)
    for now_s in (110.0, 120.0):
        assert not faults.is_active("cell_silent", 1000.0)
        clock.now_s = now_s
        faults.begin_press()
    assert [faults.is_active("cell_silent", t_s) for t_s in (120.9, 121.0, 1e6)] == [False, True, True]


@pytest.mark.parametrize(
    ("fault", "light"),
    [
        (ScriptedFault("led_dead", side="+x"), (0.0, 0.5, 0.4, 0.3)),
        (ScriptedFault("led_dead", side="-y"), (0.6, 0.5, 0.4, 0.0)),
        (ScriptedFault("led_stuck_on", side="+y"), (0.6, 1.0, 0.4, 0.3)),
        (ScriptedFault("led_dimmed", side="-x", ratio=0.5), (0.6, 0.5, 0.2, 0.3)),
        (ScriptedFault("led_open", side="+x"), (0.0, 0.5, 0.4, 0.3)),
        (ScriptedFault("led_swapped", side="+x", other_side="-y"), (0.3, 0.5, 0.4, 0.6)),
        (ScriptedFault("led_driver_hot"), (0.0, 0.0, 0.0, 0.0)),
        (ScriptedFault("led_dimmed"), (0.54, 0.45, 0.36, 0.27)),
    ],
)
def test_an_led_gives_another_light_than_its_register_asks_for(clock, fault, light):
    assert FaultTimeline([fault], clock=clock).led_output(LIT, 100.0) == pytest.approx(light)


def test_a_dead_led_is_dark_even_when_it_is_dimmed_and_a_stuck_one_shines_while_all_are_off(clock):
    faults = [
        ScriptedFault("led_dimmed"),
        ScriptedFault("led_dead", side="+x"),
        ScriptedFault("led_stuck_on", side="-x"),
    ]
    assert FaultTimeline(faults, clock=clock).led_output((0.0,) * 4, 100.0) == (0.0, 0.0, 1.0, 0.0)


def test_swapped_plugs_are_before_the_leds(clock):
    """The output of +x feeds the LED at -x, which is dead."""
    faults = [ScriptedFault("led_dead", side="-x"), ScriptedFault("led_swapped", side="+x", other_side="-x")]
    assert FaultTimeline(faults, clock=clock).led_output((0.6, 0.0, 0.4, 0.0), 100.0) == (0.4, 0.0, 0.0, 0.0)


def test_foreign_light_adds_up_and_the_wettest_counts(clock):
    faults = [ScriptedFault("ambient_light", ratio=0.1), ScriptedFault("ambient_light", ratio=0.2, from_s=1.0)]
    faults += [ScriptedFault("wet_face", ratio=0.4), ScriptedFault("wet_face", ratio=0.7, from_s=1.0)]
    timeline = FaultTimeline(faults, clock=clock)
    assert (timeline.ambient_ratio(100.5), timeline.wet_ratio(100.5)) == pytest.approx((0.1, 0.4))
    assert (timeline.ambient_ratio(101.0), timeline.wet_ratio(101.0)) == pytest.approx((0.3, 0.7))


def test_dirt_lets_out_light_only_of_leds_that_are_on(clock):
    timeline = FaultTimeline([ScriptedFault("dirty_face", ratio=0.2)], clock=clock)
    assert timeline.stray_ratio((0.5, 0.5, 0.0, 0.0), 100.5) == pytest.approx(0.05)
    assert timeline.stray_ratio((0.0,) * 4, 100.5) == 0.0
    assert NO_FAULTS.stray_ratio((1.0,) * 4, 100.5) == 0.0


def test_a_clock_that_jumped_shows_another_time_and_the_monotonic_clock_does_not(clock):
    faults = [ScriptedFault("clock_jump", step_s=-3600.0, from_s=2.0, until_s=4.0)]
    timeline = FaultTimeline(faults, clock=clock, wall_clock=lambda: 5000.0)
    shown = []
    for clock.now_s in (100.0, 102.0, 104.0):
        shown.append(timeline.wall_time_s())
    assert shown == [5000.0, 1400.0, 5000.0]


def test_a_clock_that_was_set_goes_on_from_its_date_whatever_the_true_one_says(clock):
    date = datetime(1970, 1, 1, 0, 10, tzinfo=UTC)
    faults = [
        ScriptedFault("clock_set", date=date, from_s=2.0, until_s=6.0),
        ScriptedFault("clock_jump", step_s=60.0, from_s=4.0),
    ]
    timeline = FaultTimeline(faults, clock=clock, wall_clock=lambda: 5000.0)
    shown = []
    for clock.now_s in (100.0, 102.0, 103.0, 105.0, 106.0):
        shown.append(timeline.wall_time_s())
    assert shown == [5000.0, 600.0, 601.0, 663.0, 5060.0]


def test_the_bus_answers_with_the_kernels_error_numbers(clock):
    for kind, number in (("i2c_nack", 121), ("i2c_stuck", 110), ("camera_stall", None)):
        assert FaultTimeline([ScriptedFault(kind)], clock=clock).i2c_errno() == number


def test_without_faults_nothing_is_wrong():
    assert NO_FAULTS.led_output(LIT, 1e6) == LIT
    assert (NO_FAULTS.ambient_ratio(1e6), NO_FAULTS.wet_ratio(1e6), NO_FAULTS.i2c_errno()) == (0.0, 0.0, None)


@pytest.mark.parametrize(
    ("settings", "quantity", "words"),
    [
        ({"kind": "gremlin"}, "faults.kind", "'gremlin', but must be one of camera_stall"),
        ({"kind": "camera_stall", "from_s": -1.0}, "faults.from_s", "at least 0"),
        ({"kind": "camera_stall", "from_s": 2.0, "until_s": 2.0}, "faults.until_s", "above from_s, 2 s"),
        ({"kind": "camera_stall", "until_s": float("nan")}, "faults.until_s", "nan"),
        ({"kind": "camera_stall", "from_press": -1}, "faults.from_press", "at least 0"),
        ({"kind": "clock_set"}, "faults.date", "missing"),
        ({"kind": "clock_set", "date": datetime(2069, 11, 25)}, "faults.date", "a time with its zone"),
        ({"kind": "led_dead"}, "faults.side", "missing, but must be given for led_dead: add it"),
        ({"kind": "led_dead", "side": "left"}, "faults.side", r"one of \+x, \+y, -x, -y"),
        ({"kind": "led_swapped", "side": "+x"}, "faults.other_side", "given for led_swapped"),
        ({"kind": "led_swapped", "side": "+x", "other_side": "up"}, "faults.other_side", r"one of \+x, \+y, -x, -y"),
        ({"kind": "camera_stall", "side": "+x"}, "faults.side", "left out of camera_stall: remove it"),
        ({"kind": "led_dimmed", "ratio": 1.1}, "faults.ratio", "at most 1"),
        ({"kind": "clock_jump"}, "faults.step_s", "given for clock_jump"),
        ({"kind": "clock_jump", "step_s": float("inf")}, "faults.step_s", "is inf"),
    ],
)
def test_a_fault_that_makes_no_sense_is_refused_by_its_key(settings, quantity, words):
    with pytest.raises(InvalidQuantity, match=words) as refusal:
        ScriptedFault(**settings)
    assert refusal.value.quantity == quantity


def test_a_call_is_held_up_until_the_fault_is_over(clock, monkeypatch):
    faults = FaultTimeline([ScriptedFault("i2c_frozen", until_s=0.05)], clock=clock)
    monkeypatch.setattr(
        "device.simulation.faults.time.sleep", lambda seconds: setattr(clock, "now_s", clock.now_s + seconds)
    )
    faults.hold_up("i2c_frozen")
    assert clock.now_s >= 100.05
    NO_FAULTS.hold_up("i2c_frozen")
