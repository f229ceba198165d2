"""How far two presses on one bare block differ smoothly, in made-up images whose difference is known."""

import cv2
import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.flat_field_error import flat_field_error
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Frame

SHAPE, SCALE = (164, 240), PixelScale(0.1, 0.11)
DARK = np.full(SHAPE, 4 * 256, np.uint16)
Y_MM, X_MM = (step * (np.arange(count) - (count - 1) / 2) for step, count in zip((0.11, 0.1), SHAPE, strict=True))
FORCES_N = np.linspace(0.3, 0.5, 12)
LIT = (0.6,) * 4
BLOCK = np.exp(-(X_MM**2 + (1.3 * Y_MM[:, None]) ** 2) / 100)
"""A face that is a tenth as bright at its rim as in its middle."""
POWER = 0.6 + 0.01 * X_MM + 0.02 * np.abs(Y_MM[:, None])
"""Each place grows with the force in its own way."""


def press(error=0.0, forces_n=FORCES_N, noise_counts=0.0, rng=None):
    """Return frames of 16 bits of a press on the block, its light off by an error [height, width]."""
    frames = []
    for number, force_n in enumerate(forces_n):
        light = 120 * BLOCK * (force_n / 0.5) ** POWER * (1 + error)
        noise = rng.normal(0.0, noise_counts, SHAPE) if rng else 0.0
        counts = np.clip(np.rint(DARK + 256 * (light + noise)), 0, 1023 << 6).astype(np.uint16)
        frames.append(Frame(counts, "reference", float(number), float(force_n), LIT))
    return frames


def smooth_field(rng, length_mm=2.0):
    """Return a field [height, width] of variance 1 and correlation exp(-distance^2 / (2 length^2))."""
    sigma_x, sigma_y = length_mm / np.sqrt(2) / SCALE.mm_per_px_x, length_mm / np.sqrt(2) / SCALE.mm_per_px_y
    margin = 120
    white = rng.standard_normal((SHAPE[0] + 2 * margin, SHAPE[1] + 2 * margin)).astype(np.float32)
    smooth = cv2.GaussianBlur(white, (0, 0), sigma_x, sigmaY=sigma_y)[margin:-margin, margin:-margin]
    return smooth * 2 * np.sqrt(np.pi * sigma_x * sigma_y)


def level_of(second, first=None):
    return flat_field_error(press() if first is None else first, second, DARK, SCALE).level_ratio


def test_a_known_level_is_found_over_many_fields():
    """Each shows some thirty independent parts, so one is known to a seventh."""
    rng = np.random.default_rng(5)
    found = [level_of(press(0.003 * smooth_field(rng))) for _ in range(30)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.003, rel=0.12)


@pytest.mark.parametrize(
    ("second", "most"),
    [
        (press(), 1e-6),
        (press(forces_n=FORCES_N[::-1] * 0.97), 2e-5),  # pressed otherwise: each place grows in its own way
        (press(0.1), 1e-6),  # brighter LEDs, or a force that is read wrong
        (press(0.01 * X_MM / X_MM.max()), 2e-5),  # a lean, to second order
    ],
)
def test_what_is_no_error_of_the_flat_field_is_none(second, most):
    assert level_of(second) <= most


def test_noise_is_no_level_and_is_told_by_itself():
    rng = np.random.default_rng(3)
    noisy = [press(noise_counts=0.5, rng=rng) for _ in range(2)]
    found = flat_field_error(*noisy, DARK, SCALE)
    assert 0 < found.noise_ratio < 1e-3
    assert found.level_ratio < found.noise_ratio
    field = 0.003 * smooth_field(rng)
    seen = level_of(press(field, noise_counts=0.5, rng=rng), noisy[0])
    assert seen == pytest.approx(level_of(press(field)), rel=0.1)


def test_frames_of_8_bits_say_the_same():
    def of_8_bits(frames):
        return [
            Frame((one.counts >> 8).astype(np.uint8), one.role, one.t_s, one.force_n, one.led_ratio) for one in frames
        ]

    error = 0.003 * smooth_field(np.random.default_rng(1))
    found = flat_field_error(of_8_bits(press()), of_8_bits(press(error)), (DARK >> 8).astype(np.uint8), SCALE)
    assert found.level_ratio == pytest.approx(level_of(press(error)), rel=0.1)


def test_cells_that_take_no_more_light_are_left_out_and_tell_nothing():
    error = 0.003 * smooth_field(np.random.default_rng(2))
    shone_on = 4.0 * (X_MM > 0) * np.ones(SHAPE)
    found = [level_of(press(shone_on + one), press(shone_on)) for one in (0.0, error)]
    assert found[0] < 1e-5 < 1e-3 < found[1]
    with pytest.raises(InvalidQuantity, match="lit cells of the face"):
        level_of(press(50.0))


@pytest.mark.parametrize(
    ("second", "quantity"),
    [
        (press()[:3], "frames of a press"),
        (press(forces_n=[0.0, 0.1, 0.2, 0.3]), "force_n of a press"),
        (press(-1.0), "lit cells of the face"),
    ],
)
def test_presses_that_cannot_tell_are_refused(second, quantity):
    with pytest.raises(InvalidQuantity) as refused:
        flat_field_error(press(), second, DARK, SCALE)
    assert refused.value.quantity == quantity
