"""The size of a pixel to lengths on the sensing face."""

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale


def test_pixels_are_counted_from_the_middle_of_the_image_each_way_by_its_own_pitch():
    x, y = PixelScale(0.5, 0.25).coordinates_mm((3, 4))
    assert x.tolist() == [[-0.75, -0.25, 0.25, 0.75]]
    assert y.tolist() == [[-0.25], [0.0], [0.25]]
    assert PixelScale(0.5, 0.25).area_mm2 == 0.125


@pytest.mark.parametrize("pitch", [0.0, -0.1, 1.1, np.nan])
def test_an_impossible_pixel_size_is_refused_by_its_name(pitch):
    with pytest.raises(InvalidQuantity, match="^mm_per_px_y is"):
        PixelScale(0.03, pitch)
