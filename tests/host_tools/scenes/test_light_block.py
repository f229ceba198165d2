"""The block that is built: its default can be, and what cannot be built is refused by name."""

import math

import pytest

from device.measurement.quantities import InvalidQuantity
from host_tools.scenes.light_block import LightBlock


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("refractive_index", 0.9),
        ("glass_refractive_index", 0.99),
        ("wall_reflectance", 1.01),
        ("wall_reflectance", -0.01),
        ("haze_per_mm", -0.001),
        ("half_width_mm", 0.0),
        ("thickness_mm", math.nan),
        ("led_height_mm", 9.5),
        ("led_height_mm", 0.5),
        ("led_radius_mm", 12.5),
        ("led_lens_exponent", 0.0),
        ("led_coupling", "glued"),
        ("aperture_radius_mm", 12.0),
        ("camera_distance_mm", 1.0),
    ],
)
def test_a_block_that_cannot_be_built_is_refused_by_name(name, value):
    with pytest.raises(InvalidQuantity, match=name):
        LightBlock(**{name: value})
