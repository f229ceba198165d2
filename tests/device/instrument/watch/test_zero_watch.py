"""The zero that is followed: small and steady readings are taken off, others told, and what cannot be is a fault."""

import numpy as np
import pytest

from device.errors import ZeroShiftError
from device.instrument.watch.zero_watch import MOST_MOVED_N, ZeroWatch
from device.measurement.recording.tactile_image import Frame

CONTACT_N = 0.05
BLACK = np.zeros((2, 2), np.uint8)


class Cell:
    """Its zero moves as it is told, unless that is too far."""

    def __init__(self):
        self.moved_n, self.is_far = [], False

    def move_zero(self, read_n):
        if self.is_far:
            raise ZeroShiftError("It is 0.201 N from that of commissioning.", "Have it checked.")
        self.moved_n.append(read_n)


def unloaded(*forces_n):
    return [Frame(BLACK, "dark", 0.0, force_n, (0.0, 0.0, 0.0, 0.0)) for force_n in forces_n]


@pytest.fixture
def cell():
    return Cell()


def test_what_is_read_without_a_touch_is_taken_off_and_the_frames_count_from_there(cell):
    watch = ZeroWatch(CONTACT_N)
    frames = watch.saw(unloaded(0.001, 0.002), cell)
    assert cell.moved_n == [pytest.approx(0.0015)]
    assert [frame.force_n for frame in frames] == pytest.approx([-0.0005, 0.0005])
    assert watch.warned(()) == ()


def test_it_is_followed_a_little_at_a_time_and_what_is_left_is_told(cell):
    """A touch too light to be felt must not become the zero of the next press."""
    watch = ZeroWatch(CONTACT_N)
    frames = watch.saw(unloaded(-0.008, -0.008), cell)
    assert cell.moved_n == [-MOST_MOVED_N]
    assert [frame.force_n for frame in frames] == pytest.approx([-0.006, -0.006])
    (warning,) = watch.warned(())
    assert "reads up to 0.006 N from zero" in warning.cause
    watch.saw(unloaded(-0.004, -0.004), cell)
    assert watch.warned((warning,)) == ()


@pytest.mark.parametrize("forces_n", [(0.011, 0.011), (-0.02, -0.02), (0.0, 0.012), (0.04, 0.03), (-0.003, 0.004)])
def test_what_may_be_a_touch_or_varies_is_told_and_left(cell, forces_n):
    watch = ZeroWatch(CONTACT_N)
    watch.saw(unloaded(*forces_n), cell)
    (warning,) = watch.warned(())
    assert (warning.code, warning.is_lasting, cell.moved_n) == ("E309", True, [])
    watch.saw(unloaded(0.0, 0.0), cell)
    assert watch.warned((warning,)) == ()


def test_a_zero_that_has_gone_as_far_as_it_may_stays_and_is_told(cell):
    """The probe goes on measuring, as it did by the zero of before."""
    watch, cell.is_far = ZeroWatch(CONTACT_N), True
    frames = watch.saw(unloaded(0.004, 0.004), cell)
    assert [frame.force_n for frame in frames] == [0.004, 0.004]
    (warning,) = watch.warned(())
    assert "It is 0.201 N from that of commissioning." in warning.cause


def test_far_below_zero_nothing_can_be_touched_and_the_zero_is_wrong(cell):
    watch = ZeroWatch(CONTACT_N)
    with pytest.raises(ZeroShiftError, match=r"reads -0\.150 N: its zero was taken under a load"):
        watch.saw(unloaded(-0.15, -0.15), cell)
    assert (watch.warned(()), cell.moved_n) == ((), [])
