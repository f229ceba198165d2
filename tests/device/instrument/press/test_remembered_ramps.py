"""A scan's ramps are read once each: of the very frames, to the same numbers, and of no frame longer than it lives."""

import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from device.instrument.press import remembered_ramps
from device.instrument.press.remembered_ramps import RememberedRamps
from device.measurement.parameters import NOMINAL
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.radial_profile import ReadBeside, press_profiles
from host_tools.press_models.recorded_presses import recorded_press

RAMPS = 3


@pytest.fixture(scope="module")
def scan(tables):
    parameters = np.array([12.0, 6.0, 60.0, *NOMINAL.values()])
    return recorded_press(tables, parameters, "precise", 5, further_mm=(4.0, 2.0))


@pytest.fixture
def readings(monkeypatch):
    """What was read: a word for each time."""
    read, beside, profile_of = [], remembered_ramps.read_beside, ReadBeside.profile_of
    monkeypatch.setattr(remembered_ramps, "read_beside", lambda one: read.append("beside") or beside(one))
    monkeypatch.setattr(ReadBeside, "profile_of", lambda self, one: read.append("ramp") or profile_of(self, one))
    return read


def first_ramps(recording, count):
    """Return the recording as it was after so many ramps: another one, of the same frames."""
    return replace(recording, frames=tuple(f for f in recording.frames if f.role != "press" or f.ramp < count))


def rows(profiles):
    return [profile.as_row().tobytes() for profile in profiles]


def test_each_ramp_is_read_once_to_the_same_bytes_as_without_a_memory(scan, readings):
    ramps = RememberedRamps()
    for count in range(1, RAMPS + 1):
        expected = rows(press_profiles(first_ramps(scan, count)))
        readings.clear()
        assert rows(ramps.profiles(first_ramps(scan, count))) == expected
        assert readings == (["beside", "ramp"] if count == 1 else ["ramp"])


def test_what_lies_beside_is_read_before_there_is_a_ramp_on_the_lesion(scan, readings):
    ramps = RememberedRamps()
    ramps.look_beside(first_ramps(scan, 0))
    assert readings == ["beside"]
    found = ramps.profiles(first_ramps(scan, 1))
    assert readings == ["beside", "ramp"]
    assert rows(found) == rows(press_profiles(first_ramps(scan, 1)))


def changed(frame, role, **changes):
    return replace(frame, **changes) if frame.role == role else frame


@pytest.mark.parametrize("role", ["dark", "reference", "press"])
def test_another_frame_force_light_or_camera_is_read_anew(scan, role):
    """A frame that is equal is another one all the same: it is the object that is remembered."""
    usual = first_ramps(scan, 1)
    others = [
        [changed(f, role, counts=f.counts.copy()) for f in usual.frames],
        [changed(f, role, counts=np.minimum(f.counts, 250) + np.uint8(1)) for f in usual.frames],
        [changed(f, role, force_n=1.01 * f.force_n) for f in usual.frames],
    ]
    recordings = [replace(usual, frames=tuple(frames)) for frames in others]
    recordings.append(replace(usual, camera=replace(usual.camera, axis_x_mm=0.4)))
    ramps = RememberedRamps()
    for one in (*recordings, usual, *recordings[::-1]):
        assert rows(ramps.profiles(one)) == rows(press_profiles(one))


def test_a_press_that_is_left_out_costs_the_others_nothing(scan, readings):
    """The second of three was refused: the third is the scan's second, and the first is still known."""
    ramps = RememberedRamps()
    ramps.profiles(first_ramps(scan, 2))
    kept = tuple(replace(f, ramp=min(f.ramp, 1)) for f in scan.frames if f.ramp != 1)
    readings.clear()
    ramps.profiles(replace(scan, frames=kept))
    assert readings == ["ramp"]


def test_no_frame_is_held(scan):
    ramps = RememberedRamps()
    recording = replace(scan, frames=tuple(replace(f, counts=f.counts.copy()) for f in scan.frames))
    ramps.profiles(recording)
    alive = [weakref.ref(frame.counts) for frame in recording.frames]
    del recording
    gc.collect()
    assert not any(counts() is not None for counts in alive)


def test_what_cannot_be_read_is_told_with_the_answer_and_not_before(scan):
    ramps, dark = RememberedRamps(), replace(scan, frames=tuple(scan.with_role("dark")))
    ramps.look_beside(dark)
    with pytest.raises(InvalidQuantity, match="reference frames"):
        ramps.profiles(dark)
