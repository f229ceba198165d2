"""The zero that is followed: small and steady readings are taken off, others told, and what cannot be is a fault."""

import numpy as np
import pytest

from device.errors import ZeroShiftError
from device.instrument.watch.zero_watch import ZeroWatch
from device.measurement.recording.tactile_image import Frame

CONTACT_N = 0.05
BLACK = np.zeros((2, 2), np.uint8)


class Cell:
    def __init__(self):
        self.moved_n = []

    def move_zero(self, read_n):
        self.moved_n.append(read_n)


def unloaded(*forces_n):
    return [Frame(BLACK, "dark", 0.0, force_n, (0.0, 0.0, 0.0, 0.0)) for force_n in forces_n]


@pytest.fixture
def cell():
    return Cell()


def test_what_is_read_without_a_touch_is_taken_off(cell):
    ZeroWatch(CONTACT_N).saw(unloaded(0.004, 0.006), cell)
    assert cell.moved_n == [pytest.approx(0.005)]


@pytest.mark.parametrize("forces_n", [(0.011, 0.011), (-0.02, -0.02), (0.0, 0.012), (0.04, 0.03)])
def test_what_may_be_a_touch_or_varies_is_told_and_left(cell, forces_n):
    watch = ZeroWatch(CONTACT_N)
    watch.saw(unloaded(*forces_n), cell)
    (warning,) = watch.warned(())
    assert (warning.code, warning.is_lasting, cell.moved_n) == ("E309", True, [])
    watch.saw(unloaded(0.0, 0.0), cell)
    assert watch.warned((warning,)) == ()


def test_far_below_zero_nothing_can_be_touched_and_the_zero_is_wrong(cell):
    watch = ZeroWatch(CONTACT_N)
    with pytest.raises(ZeroShiftError, match=r"reads -0\.150 N: its zero was taken under a load"):
        watch.saw(unloaded(-0.15, -0.15), cell)
    assert (watch.warned(()), cell.moved_n) == ((), [])
