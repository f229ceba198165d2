"""The record of a measurement: which numbers it takes from the frames of the press."""

import numpy as np
import pytest

from device.config import CameraSection, Config
from device.instrument.press.record import measurement_record, recording_of
from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate
from device.measurement.recording.camera_geometry import CameraGeometry
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


def test_a_recording_says_where_its_camera_looks():
    """As the settings know it: what forms rings undoes it by the recording alone."""
    camera = CameraSection(
        width_px=64, height_px=64, mm_per_px_x=0.04, axis_x_mm=0.3, axis_y_mm=-0.2, rim_distortion_percent=1.5
    )
    recording = recording_of(
        [frame("press", 0.5)],
        Config(camera=camera),
        started_at="2026-01-01T00:00:00Z",
        calibration_id="c",
        simulated_truth=None,
    )
    assert recording.camera.geometry == CameraGeometry(camera.scale, 0.3, -0.2, 1.5)
