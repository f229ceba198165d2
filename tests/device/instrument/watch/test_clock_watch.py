"""Two clocks that a test sets: wall and monotonic."""

import types

import pytest

from device.instrument.watch.clock_watch import ClockWatch


@pytest.fixture
def clocks():
    return types.SimpleNamespace(wall_s=1_700_000_000.0, monotonic_s=50.0)


@pytest.fixture
def watch(clocks):
    return ClockWatch(2.0, lambda: clocks.wall_s, lambda: clocks.monotonic_s)


def test_time_that_passes_on_both_clocks_is_no_jump(clocks, watch):
    clocks.wall_s += 86_400.0
    clocks.monotonic_s += 86_400.0
    assert watch.warning() is None


@pytest.mark.parametrize("step_s", [2.1, -2.1, 3600.0])
def test_a_clock_that_was_set_is_warned_of_once_with_the_step(clocks, watch, step_s):
    clocks.wall_s += step_s
    warning = watch.warning()
    assert (warning.code, warning.severity) == ("E701", "warning")
    assert f"set by {step_s:+.1f} s" in warning.cause
    assert watch.warning() is None


def test_it_is_steady_since_it_was_set_whoever_looks_first(clocks, watch):
    clocks.wall_s, clocks.monotonic_s = clocks.wall_s + 600.0, clocks.monotonic_s + 600.0
    assert (watch.steady_s, watch.is_steady) == (600.0, False)
    clocks.wall_s += 86_400.0
    assert watch.steady_s == 0.0
    clocks.wall_s, clocks.monotonic_s = clocks.wall_s + 60.0, clocks.monotonic_s + 60.0
    assert watch.steady_s == 60.0
    clocks.wall_s, clocks.monotonic_s = clocks.wall_s + 840.0, clocks.monotonic_s + 840.0
    assert watch.is_steady
    assert "set by +86400.0 s" in watch.warning().cause
    assert watch.warning() is None


def test_slewing_is_no_jump_however_long_it_goes_on(clocks, watch):
    """500 ppm for a day is 43 s, but 0.05 s in 100 s."""
    for _ in range(864):
        clocks.monotonic_s += 100.0
        clocks.wall_s += 100.05
        assert watch.warning() is None


def test_now_is_the_wall_clock_in_utc(clocks, watch):
    clocks.wall_s = 1_700_000_000.25
    assert watch.now() == "2023-11-14T22:13:20.250Z"


def test_the_offset_of_the_clocks_changes_only_when_one_is_set(clocks, watch):
    before_s = watch.offset_s
    clocks.wall_s += 60.0
    clocks.monotonic_s += 60.0
    assert watch.offset_s == before_s
    clocks.wall_s += 5.0
    assert watch.offset_s - before_s == pytest.approx(5.0)
    assert watch.warning() is not None
