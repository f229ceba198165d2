"""Rows of a sensor to the counts of a frame, on pictures whose answer is known on paper."""

from __future__ import annotations

import numpy as np
import pytest

from device.config_chips import RawMode
from device.hardware.camera import RawFrames


def rows_of(counts: np.ndarray, stride_bytes: int) -> np.ndarray:
    """Rows of bytes as picamera2 gives them, padded with 0xAA."""
    data = np.ascontiguousarray(counts).view(np.uint8)
    return np.pad(data, ((0, 0), (0, stride_bytes - data.shape[1])), constant_values=0xAA)


def test_eight_bits_of_the_whole_sensor_stay_as_they_are():
    counts = np.arange(24, dtype=np.uint8).reshape(4, 6)
    rows = rows_of(counts, 8)
    frame = RawFrames(RawMode.whole(6, 4)).frame(rows)
    np.testing.assert_array_equal(frame, counts)
    assert not np.shares_memory(frame, rows)


@pytest.mark.parametrize(("raw_format", "white"), [("R10", 1023), ("R12", 4095), ("R16", 65535)])
def test_more_bits_are_scaled_to_eight_and_rounded(raw_format, white):
    """A quarter of white is 64 of 256; half a count goes to the even one; white itself would be 256."""
    step = (white + 1) // 256
    counts = np.array([[0, step // 2 - 1, step // 2 + 1, (white + 1) // 4, white]], "<u2")
    frame = RawFrames(RawMode.whole(5, 1, raw_format)).frame(rows_of(counts, 16))
    assert frame.tolist() == [[0, 0, 1, 64, 255]]
    assert frame.dtype == np.uint8


def test_the_crop_is_the_middle():
    counts = np.arange(48, dtype=np.uint8).reshape(6, 8)
    np.testing.assert_array_equal(
        RawFrames(RawMode((8, 6), (4, 2), (4, 2))).frame(rows_of(counts, 8)), counts[2:4, 2:6]
    )


def test_a_pixel_is_the_mean_of_the_area_that_it_covers():
    """Three columns on two: 0, 60, 240 give (0 + 30) / 1.5 = 20 and (30 + 240) / 1.5 = 180."""
    counts = np.tile(np.array([0, 60, 240], np.uint8), (4, 1))
    frame = RawFrames(RawMode((3, 4), (3, 4), (2, 2))).frame(rows_of(counts, 3))
    assert frame.tolist() == [[20, 180], [20, 180]]


def test_bits_that_eight_do_not_have_are_averaged_before_they_are_rounded():
    """397 and 398 of 1024 are 99.25 and 99.5 of 256, their mean 99.375; as 99 and 100 their mean would be 99.5."""
    counts = np.array([[397, 397], [398, 398]], "<u2")
    assert RawFrames(RawMode((2, 2), (2, 2), (1, 1), "R10")).frame(rows_of(counts, 4)).tolist() == [[99]]


def test_the_mean_light_of_a_picture_survives_crop_and_scale():
    """The sensor of the probe: the 1070 x 800 in the middle of 1280 x 800, ten bits, to 768 x 492."""
    rng = np.random.default_rng(1)
    counts = rng.integers(200, 600, (800, 1280), dtype=np.uint16)
    frame = RawFrames(RawMode((1280, 800), (1070, 800), (768, 492), "R10")).frame(rows_of(counts, 2560))
    assert frame.shape == (492, 768)
    assert frame.mean() == pytest.approx(counts[:, 105:1175].mean() / 4, abs=0.01)


def test_a_length_on_the_face_is_the_same_before_and_after():
    """A bar of 8 mm, 0.03 mm a sensor pixel along x and y; a frame's pixel is 1.5 times as wide and 2 times as high."""
    counts = np.zeros((600, 900), np.uint8)
    bar_px = round(8.0 / 0.03)
    counts[300 - bar_px // 2 : 300 - bar_px // 2 + bar_px, 450 - bar_px // 2 : 450 - bar_px // 2 + bar_px] = 200
    frame = RawFrames(RawMode((900, 600), (720, 480), (480, 240))).frame(rows_of(counts, 900))
    width_mm = frame[120].sum() / 200 * 0.03 * 1.5
    height_mm = frame[:, 240].sum() / 200 * 0.03 * 2
    assert (width_mm, height_mm) == pytest.approx((8.0, 8.0), abs=0.02)
