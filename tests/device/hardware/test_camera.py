"""The camera driver against the virtual picamera2, whose frames show the light they were exposed with."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from device.config_chips import RawMode
from device.errors import CameraError
from device.hardware.camera import RawMonoCamera, open_camera
from device.hardware.tlc59116 import Tlc59116
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.led_sides import LedRatio
from device.simulation.chips.i2c_bus import EmulatedI2cBus
from device.simulation.chips.tlc59116_chip import Tlc59116Chip
from device.simulation.chips.virtual_camera import ExposureRequest, VirtualPicamera2

WIDTH_PX, HEIGHT_PX = 96, 64
SETTINGS = {"mode": RawMode.whole(WIDTH_PX, HEIGHT_PX), "exposure_us": 2000, "gain": 2.0, "frame_rate_hz": 100.0}


def brightness(exposure: ExposureRequest) -> NDArray[np.uint8]:
    """A flat image of 100 counts at full light on all sides."""
    return np.full((HEIGHT_PX, WIDTH_PX), round(25 * sum(exposure.led_ratio)), np.uint8)


def dark(_t_s: float) -> LedRatio:
    return 0.0, 0.0, 0.0, 0.0


def virtual(
    render: Callable[[ExposureRequest], NDArray[np.uint8]] = brightness,
    *,
    width_px: int = WIDTH_PX,
    led_ratio_at: Callable[[float], LedRatio] = dark,
    raw_formats: tuple[str, ...] = ("R8",),
) -> VirtualPicamera2:
    return VirtualPicamera2(
        render, width_px=width_px, height_px=HEIGHT_PX, led_ratio_at=led_ratio_at, raw_formats=raw_formats
    )


def test_a_frame_begun_after_the_light_was_set_shows_that_light_and_no_other():
    chip = Tlc59116Chip()
    lights = Tlc59116(EmulatedI2cBus({0x60: chip}))
    camera = RawMonoCamera(virtual(led_ratio_at=chip.ratio_at), **SETTINGS)
    for ratio, counts in [((1.0, 1.0, 1.0, 1.0), 100), ((0.0, 0.0, 0.0, 0.0), 0), ((0.0, 1.0, 0.0, 1.0), 50)]:
        acknowledged_s = lights.set_ratio(ratio)
        frame = camera.capture(begun_after_s=acknowledged_s, timeout_s=30.0)
        assert frame.exposure_start_s >= acknowledged_s - 1e-6
        assert np.unique(frame.counts).tolist() == [counts]
    camera.close()


def test_a_frame_tells_its_exposure_and_gain_and_has_no_row_padding():
    """96 px are padded to a stride of 128."""
    camera = RawMonoCamera(virtual(lambda _: np.full((HEIGHT_PX, WIDTH_PX), 7, np.uint8)), **SETTINGS)
    frame = camera.capture(begun_after_s=0.0, timeout_s=30.0)
    assert (frame.exposure_us, frame.gain) == (2000.0, 2.0)
    assert frame.counts.shape == (HEIGHT_PX, WIDTH_PX)
    assert frame.counts.min() == 7


def test_frames_come_at_the_frame_rate():
    camera = RawMonoCamera(virtual(), **SETTINGS)
    starts_s = [camera.capture(begun_after_s=0.0, timeout_s=30.0).exposure_start_s for _ in range(3)]
    periods = np.diff(starts_s) / 0.01
    np.testing.assert_allclose(periods, np.round(periods), atol=1e-4)
    assert (np.round(periods) >= 1).all()


def test_more_frames_than_buffers_can_be_taken():
    camera = RawMonoCamera(virtual(), **SETTINGS)
    for _ in range(6):
        camera.capture(begun_after_s=0.0, timeout_s=30.0)


def test_automatic_exposure_is_off_where_there_is_one():
    picam2 = virtual()
    RawMonoCamera(picam2, **SETTINGS)
    configuration = picam2.camera_configuration()
    assert configuration is not None
    assert configuration["controls"] == {
        "ExposureTime": 2000,
        "AnalogueGain": 2.0,
        "FrameDurationLimits": (10000, 10000),
        "AeEnable": False,
    }


def test_a_camera_without_automatic_exposure_is_not_asked_to_switch_it_off():
    picam2 = virtual()
    del picam2.camera_controls["AeEnable"]
    RawMonoCamera(picam2, **SETTINGS).close()


def test_no_frame_in_time_is_a_camera_error_and_costs_no_buffer():
    camera = RawMonoCamera(virtual(), **SETTINGS)
    for _ in range(5):
        with pytest.raises(CameraError, match=r"no frame within 0.01 s"):
            camera.capture(begun_after_s=time.monotonic() + 60, timeout_s=0.01)
    camera.capture(begun_after_s=0.0, timeout_s=30.0)


def test_a_silently_adjusted_size_is_refused_with_both_sizes():
    with pytest.raises(CameraError, match=r"gives size \(1280, 64\) instead of \(96, 64\)"):
        RawMonoCamera(virtual(width_px=1280), **SETTINGS)


def test_a_silently_adjusted_format_is_refused_with_both_formats():
    class CompressingCamera(VirtualPicamera2):
        """As on a board whose raw streams are compressed."""

        def configure(self, camera_config):
            super().configure(camera_config)
            self._configuration["raw"]["format"] = "MONO_PISP_COMP1"

    picam2 = CompressingCamera(brightness, width_px=WIDTH_PX, height_px=HEIGHT_PX, led_ratio_at=dark)
    with pytest.raises(CameraError, match="gives format MONO_PISP_COMP1 instead of R8"):
        RawMonoCamera(picam2, **SETTINGS)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"gain": 20.0}, r"AnalogueGain is set to 20.0, but this camera takes 1.0 to 16.0"),
        ({"frame_rate_hz": 200.0}, r"FrameDurationLimits is set to \(5000, 5000\), but this camera takes 8333"),
    ],
)
def test_a_control_that_would_be_clamped_in_silence_is_refused(setting, message):
    with pytest.raises(CameraError, match=message):
        RawMonoCamera(virtual(), **SETTINGS | setting)


def test_an_exposure_longer_than_a_frame_is_refused():
    with pytest.raises(InvalidQuantity, match="exposure_us is 10001, but must be above 0 and at most 10000 us"):
        RawMonoCamera(virtual(), **SETTINGS | {"exposure_us": 10001})


def test_a_frame_of_the_wrong_shape_is_refused_with_both_shapes_and_its_buffer_given_back():
    camera = RawMonoCamera(virtual(lambda _: np.zeros((10, WIDTH_PX), np.uint8)), **SETTINGS)
    for _ in range(5):
        with pytest.raises(CameraError, match=r"shape \(10, 128\) and type uint8 instead of \(64, 128\)"):
            camera.capture(begun_after_s=0.0, timeout_s=30.0)


def test_a_frame_of_the_wrong_type_is_refused():
    camera = RawMonoCamera(virtual(lambda _: np.zeros((HEIGHT_PX, WIDTH_PX), np.uint16)), **SETTINGS)
    with pytest.raises(CameraError, match="type uint16"):
        camera.capture(begun_after_s=0.0, timeout_s=30.0)


def test_ten_bits_become_eight_of_the_same_light():
    """1000 of 1024 at the top of 16 bits: 250 of 256."""
    picam2 = virtual(lambda _: np.full((HEIGHT_PX, WIDTH_PX), 1000 << 6, np.uint16), raw_formats=("R8", "R10"))
    camera = RawMonoCamera(picam2, **SETTINGS | {"mode": RawMode.whole(WIDTH_PX, HEIGHT_PX, "R10")})
    counts = camera.capture(begun_after_s=0.0, timeout_s=30.0).counts
    assert (counts.dtype, counts.shape, np.unique(counts).tolist()) == (np.uint8, (HEIGHT_PX, WIDTH_PX), [250])


def test_a_frame_of_a_larger_sensor_is_its_middle_scaled_down():
    """96 x 64 to the 48 x 32 in the middle to 24 x 16: a ramp along x rises twice as fast, from 24.5."""

    def ramp(_: ExposureRequest) -> NDArray[np.uint8]:
        return np.tile(np.arange(WIDTH_PX, dtype=np.uint8), (HEIGHT_PX, 1)) * np.uint8(2)

    camera = RawMonoCamera(virtual(ramp), **SETTINGS | {"mode": RawMode((WIDTH_PX, HEIGHT_PX), (48, 32), (24, 16))})
    counts = camera.capture(begun_after_s=0.0, timeout_s=30.0).counts
    np.testing.assert_array_equal(counts, np.tile(np.arange(49, 49 + 4 * 24, 4, dtype=np.uint8), (16, 1)))


@pytest.mark.parametrize(
    ("controls", "seen"),
    [({"ExposureTime": 1900}, "1900 us at gain 2 "), ({"AnalogueGain": 2.25}, "2000 us at gain 2.25")],
)
def test_a_frame_that_was_not_taken_as_asked_for_is_refused(controls, seen):
    picam2 = virtual()
    camera = RawMonoCamera(picam2, **SETTINGS)
    picam2.set_controls(controls)
    later_s = time.monotonic() + 0.05
    with pytest.raises(CameraError, match=f"exposed a frame for {seen}.*instead of 2000 us at 2"):
        camera.capture(begun_after_s=later_s, timeout_s=30.0)


def test_a_camera_that_cannot_start_is_a_camera_error():
    picam2 = virtual()
    RawMonoCamera(picam2, **SETTINGS)
    with pytest.raises(CameraError, match="must be stopped before configuring"):
        RawMonoCamera(picam2, **SETTINGS)


def test_a_machine_without_picamera2_says_so_in_one_sentence(monkeypatch):
    monkeypatch.setitem(sys.modules, "picamera2", None)
    with pytest.raises(CameraError, match="picamera2 is not installed"):
        open_camera(0, **SETTINGS)


def test_a_picamera2_whose_parts_are_of_another_numpy_says_so(monkeypatch, tmp_path):
    """As that of Raspberry Pi OS Bookworm below NumPy 2: simplejpeg raises ValueError where it is imported."""
    (tmp_path / "picamera2.py").write_text("raise ValueError('numpy.dtype size changed, Expected 96, got 88')\n")
    monkeypatch.delitem(sys.modules, "picamera2", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(CameraError, match=r"cannot be loaded: numpy.dtype size changed.* the release's NumPy"):
        open_camera(0, **SETTINGS)
