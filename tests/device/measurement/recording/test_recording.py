"""A recording has one kind of frame, that of its camera, and gives those of a role in order."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.tactile_image import Frame

CAMERA = CameraSettings(
    width_px=32, height_px=24, bits=8, mm_per_px_x=0.03, mm_per_px_y=0.04, exposure_us=4000.0, gain=1.5
)
ROLES = ("dark", "reference", "press", "press")


def recording(frames):
    return Recording("one-press", "TSIS-0007", "1.0", "2026-01-02T03:04:05Z", CAMERA, frames)


def frames_of(counts):
    return tuple(Frame(counts, role, 0.1 * i, 0.25 * i, (0.6,) * 4) for i, role in enumerate(ROLES))


def test_frames_of_a_role_come_in_order():
    press = recording(frames_of(np.zeros((24, 32), np.uint8))).with_role("press")
    assert [frame.t_s for frame in press] == pytest.approx([0.2, 0.3])


def test_the_presses_on_the_lesion_come_apart_by_their_number():
    """What is of one alone is what a recording of that press would have been."""
    frames = frames_of(np.zeros((24, 32), np.uint8))
    scan = recording((*frames, replace(frames[2], ramp=2, t_s=5.0), replace(frames[2], ramp=1, t_s=4.0)))
    times_s = {ramp: [frame.t_s for frame in of_ramp] for ramp, of_ramp in scan.ramps().items()}
    assert list(times_s) == [0, 1, 2]
    assert times_s == {0: pytest.approx([0.2, 0.3]), 1: [4.0], 2: [5.0]}
    *before, pressed = scan.of_ramp(2).frames
    assert (tuple(before), pressed.t_s, pressed.ramp) == (frames[:2], 5.0, 0)
    assert pressed.counts is frames[2].counts
    assert scan.of_ramp(0).frames == frames
    assert recording(frames[:2]).ramps() == {}


@pytest.mark.parametrize(
    ("counts", "quantity"),
    [(np.zeros((20, 30), np.uint8), "frame shape"), (np.zeros((24, 32), np.uint16), "camera.bits")],
)
def test_frames_of_another_camera_are_refused(counts, quantity):
    with pytest.raises(InvalidQuantity) as refusal:
        recording(frames_of(counts))
    assert refusal.value.quantity == quantity
