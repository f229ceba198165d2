"""The tare: what the load cell reads when nothing touches the probe."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from device.errors import SlowCellError, UnsteadyTareError
from device.hardware.interfaces import CellCounts, CellSample
from device.hardware.load_cell import measure_tare
from device.measurement.quantities import InvalidQuantity


def reading(*counts: float) -> Callable[[], CellSample]:
    """Return what gives these counts, one at a time."""
    samples = iter([CellSample(0.0, CellCounts(one)) for one in counts])
    return lambda: next(samples)


def test_tare_is_the_mean_of_the_readings():
    assert measure_tare(reading(10, 12, 14), samples=3, max_spread_counts=4) == 12.0


def test_tare_is_refused_when_the_probe_is_touched():
    with pytest.raises(UnsteadyTareError, match="varies by 5 counts during tare, above the 4 allowed") as refusal:
        measure_tare(reading(10, 12, 15), samples=3, max_spread_counts=4)
    assert refusal.value.code == "E308"
    assert refusal.value.remedy.startswith("Lift the probe")


@pytest.mark.parametrize(("hz", "is_refused"), [(80.0, False), (15.1, False), (14.0, True), (5.0, True)])
def test_an_amplifier_that_is_too_slow_to_follow_a_hand_is_refused(hz, is_refused):
    """Five readings a second is what an OpenScale gives as it is delivered."""
    samples = iter([CellSample(100.0 + number / hz, CellCounts(10.0)) for number in range(5)])
    if is_refused:
        with pytest.raises(SlowCellError, match=f"gives {hz:.3g} readings a second, fewer than 15"):
            measure_tare(lambda: next(samples), samples=5, max_spread_counts=4)
    else:
        assert measure_tare(lambda: next(samples), samples=5, max_spread_counts=4) == 10.0


def test_tare_of_no_readings_is_refused():
    with pytest.raises(InvalidQuantity, match="samples is 0"):
        measure_tare(reading(), samples=0, max_spread_counts=4)
