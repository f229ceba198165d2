"""The record of a measurement: which numbers it takes from the frames of the press."""

import numpy as np
import pytest

from device.config import CameraSection, Config
from device.instrument.press.record import measurement_record, recording_of
from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate
from device.measurement.recording.tactile_image import Frame

LIT = (0.6, 0.6, 0.6, 0.6)


def frame(role, force_n):
    return Frame(np.zeros((64, 64), np.uint8), role, 0.0, force_n, LIT)


def test_the_force_of_a_measurement_is_the_mean_of_the_frames_of_its_press():
    """0.2, 0.3 and 0.7 N: 0.4 N, which is neither their largest nor their middle one; the reference does not count."""
    frames = [frame("reference", 0.9), *(frame("press", force_n) for force_n in (0.2, 0.7, 0.3))]
    config = Config(camera=CameraSection(width_px=64, height_px=64))
    recording = recording_of(
        frames, config, started_at="2026-01-01T00:00:00Z", calibration_id="c", simulated_truth=None
    )
    estimate = Estimate(*[UNKNOWN_QUANTITY] * 3, "not_identifiable", "A stand-in.", "paper", "m", "00", "c", False, {})
    record = measurement_record(recording, estimate, "paper", [])
    assert record["force_n"] == pytest.approx(0.4)
    assert record["frames"] == 3
    assert record["recording_id"] == recording.id
