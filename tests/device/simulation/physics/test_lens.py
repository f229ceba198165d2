"""From the render grid to the pixels: lines stay lines, a point becomes a Gaussian, corners darken by cos^4."""

import math

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale
from device.simulation.physics.lens import Lens, Projection

SHAPE, SCALE = (60, 80), PixelScale(0.1, 0.12)
X, Y = np.linspace(-6, 6, 61), np.linspace(-5, 5, 51)


def projected(field, lens):
    return Projection(lens, X, Y, SHAPE, SCALE)(np.asarray(field, np.float32))


def test_a_plane_is_sampled_at_the_pixels_own_millimetres():
    """Columns and rows have different pitches: 2 + 0.3 x - 0.2 y keeps its slopes in mm."""
    image = projected(2 + 0.3 * X[None, :] - 0.2 * Y[:, None], Lens(blur_px=0.0, vignetting=False))
    x_mm, y_mm = SCALE.coordinates_mm(SHAPE)
    np.testing.assert_allclose(image, 2 + 0.3 * x_mm - 0.2 * y_mm, rtol=1e-5)


def test_blur_keeps_the_light_and_spreads_a_line_by_its_own_width():
    line = np.zeros((51, 61))
    line[:, 30] = 1.0
    sharp, soft = (projected(line, Lens(blur_px=blur, vignetting=False))[30] for blur in (0.0, 3.0))
    x = np.arange(80)
    variance = [np.average((x - np.average(x, weights=row)) ** 2, weights=row) for row in (sharp, soft)]
    assert soft.sum() == pytest.approx(sharp.sum(), rel=1e-5)
    assert variance[1] - variance[0] == pytest.approx(9.0, rel=0.01)


def test_light_falls_off_as_the_fourth_power_of_the_cosine():
    image = projected(np.ones((51, 61)), Lens(blur_px=0.0, distance_mm=8.0))
    x_mm, y_mm = SCALE.coordinates_mm(SHAPE)
    cosine = np.cos(np.arctan(np.hypot(x_mm, y_mm) / 8.0))
    np.testing.assert_allclose(image, cosine**4, rtol=1e-5)


@pytest.mark.parametrize(("name", "value"), [("blur_px", -0.1), ("blur_px", math.nan), ("distance_mm", 0.0)])
def test_an_impossible_lens_is_refused_by_name(name, value):
    with pytest.raises(InvalidQuantity, match=rf"^lens\.{name} is"):
        Lens(**{name: value})
