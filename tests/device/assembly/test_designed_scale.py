"""The pixel size of the virtual camera: by design, not by what the settings believe of it."""

from dataclasses import astuple

import pytest

from device.assembly.probe import designed_scale
from device.config import CameraSection
from device.measurement.recording.pixel_scale import PixelScale

R10 = {"raw_format": "R10", "sensor_width_px": 1280, "sensor_height_px": 800, "crop_width_px": 1070}


def test_pixel_sizes_that_are_set_do_not_move_the_virtual_camera():
    """They were found from `[world.camera]`, which counts already."""
    found = {"mm_per_px_x": 0.0316, "mm_per_px_y": 0.0361}
    for mode in ({}, R10):
        assert designed_scale(CameraSection(**found, **mode)) == CameraSection(**mode).sensor_scale


def test_half_as_many_pixels_are_twice_as_large():
    camera = CameraSection(width_px=384, height_px=246)
    assert astuple(designed_scale(camera)) == pytest.approx(astuple(PixelScale(0.0625, 0.07292)))
