"""Frames through shared memory: whole or not at all, and nothing is left behind."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from device.errors import TornFrameError
from device.hardware.frame_ring import SLOTS, FrameRing

SHAPE = (3, 5)
"""15 bytes: the slots do not follow each other without padding."""


@pytest.fixture
def rings() -> Iterator[tuple[FrameRing, FrameRing]]:
    """Both ends of one ring."""
    ours = FrameRing.create(SHAPE)
    theirs = FrameRing.attach(ours.name, SHAPE)
    ours.unlink()
    yield ours, theirs
    ours.close()
    theirs.close()


def frame(value: int) -> np.ndarray:
    return np.arange(15, dtype=np.uint8).reshape(SHAPE) + np.uint8(value)


def test_what_one_end_writes_the_other_reads(rings):
    ours, theirs = rings
    for value in range(3 * SLOTS):
        np.testing.assert_array_equal(ours.read(theirs.write(frame(value))), frame(value))


def test_a_frame_can_be_read_until_as_many_others_as_there_are_slots_came_after_it(rings):
    ours, theirs = rings
    first = theirs.write(frame(100))
    for value in range(SLOTS - 1):
        theirs.write(frame(value))
    np.testing.assert_array_equal(ours.read(first), frame(100))
    theirs.write(frame(7))
    with pytest.raises(TornFrameError, match="Frame 1 was overwritten before it was read"):
        ours.read(first)


def test_a_frame_that_is_overwritten_while_it_is_read_is_refused(rings):
    """The writer comes round to the slot just as the reader has copied it."""
    ours, theirs = rings
    number = theirs.write(frame(1))

    class Overtaken:
        """A slot whose counts are overwritten after each look at its number."""

        def __init__(self, slot: np.void) -> None:
            self.slot = slot

        def __getitem__(self, name: str) -> object:
            value = self.slot[name].copy()
            if name == "number":
                self.slot["number"] += SLOTS
            return value

    whole = ours._slots
    ours._slots = {number % SLOTS: Overtaken(whole[number % SLOTS])}
    with pytest.raises(TornFrameError):
        ours.read(number)
    ours._slots = whole


def test_a_read_frame_is_a_copy(rings):
    ours, theirs = rings
    read = ours.read(theirs.write(frame(1)))
    for value in range(2 * SLOTS):
        theirs.write(frame(value))
    np.testing.assert_array_equal(read, frame(1))


def test_without_its_name_a_ring_leaves_nothing_behind(rings):
    ours, _ = rings
    assert not (Path("/dev/shm") / ours.name.lstrip("/")).exists()
