"""Half widths are those of the intervals that the estimate states."""

from dataclasses import replace

import pytest
from stand_in_adviser import advice

from device.measurement.estimate import Quantity
from device.measurement.scan_advice import half_widths


def test_the_half_width_is_half_of_the_interval_wherever_the_value_lies_and_none_without_one():
    estimate = replace(advice(1.0).estimate, depth_mm=Quantity(4.1, 4.0, 7.0, 0.5, False, low_is_open=True))
    assert half_widths(estimate) == pytest.approx({"size_mm": 1.0, "depth_mm": 1.5})
