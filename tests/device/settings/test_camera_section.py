"""The settings of the camera: an exposure within a frame, and a frame made of a part of the sensor."""

import pytest

from device.hardware.raw_mode import RawMode
from device.measurement.quantities import InvalidQuantity
from device.settings.camera_section import CameraSection


@pytest.mark.parametrize("rate_hz", [0.9, 240.1])
def test_a_frame_rate_beyond_its_bound_is_refused(rate_hz):
    with pytest.raises(InvalidQuantity, match=r"^camera\.frame_rate_hz is"):
        CameraSection(frame_rate_hz=rate_hz)


def test_an_exposure_longer_than_a_frame_is_refused_with_the_frames_duration():
    with pytest.raises(InvalidQuantity, match="at most 10000 us, one frame"):
        CameraSection(frame_rate_hz=100.0, exposure_us=10_001)


def test_a_frame_is_the_whole_sensor_pixel_by_pixel_unless_told_otherwise():
    assert CameraSection().raw_mode == RawMode.whole(768, 492)
    assert CameraSection().sensor_scale == CameraSection().scale


def test_a_larger_sensor_has_smaller_pixels_on_the_face():
    """1070 of its columns are 768 of a frame, of 0.03125 mm; 800 rows are 492 of 0.03646 mm: square within 0.03 %."""
    camera = CameraSection(sensor_width_px=1280, sensor_height_px=800, crop_width_px=1070, raw_format="R10")
    assert camera.raw_mode == RawMode((1280, 800), (1070, 800), (768, 492), "R10")
    assert camera.sensor_scale.mm_per_px_x == pytest.approx(0.0224299, abs=1e-7)
    assert camera.sensor_scale.mm_per_px_y == pytest.approx(0.0224229, abs=1e-7)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"sensor_width_px": 640}, r"camera.sensor_width_px is 640, but must be at least 768 and .*frame's or more"),
        ({"sensor_height_px": 400, "crop_height_px": 300}, "camera.sensor_height_px is 400, but must be at least 492"),
        ({"crop_width_px": 800}, r"camera.crop_width_px is 800, but must be at least 768 and at most 768 px"),
        ({"sensor_height_px": 800, "crop_height_px": 400}, "camera.crop_height_px is 400, but must be at least 492"),
        ({"raw_format": "R10_CSI2P"}, "camera.raw_format is 'R10_CSI2P', but must be one of R8, R10, R12, R16"),
    ],
)
def test_a_part_of_the_sensor_that_is_not_on_it_or_less_than_a_frame_is_refused(settings, message):
    with pytest.raises(InvalidQuantity, match=message):
        CameraSection(**settings)
