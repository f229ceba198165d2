"""The tare: what the load cell reads when nothing touches the probe."""

from __future__ import annotations

import pytest

from device.errors import LoadCellError
from device.hardware.interfaces import CellCounts, CellSample
from device.hardware.load_cell import measure_tare
from device.measurement.quantities import InvalidQuantity


class ScriptedCell:
    """Gives the counts it was made with, one at a time."""

    def __init__(self, *counts: float) -> None:
        self._counts = iter(counts)

    def read(self, *, timeout_s: float) -> CellSample:
        return CellSample(0.0, CellCounts(next(self._counts)))

    def close(self) -> None: ...


def test_tare_is_the_mean_of_the_readings():
    assert measure_tare(ScriptedCell(10, 12, 14), samples=3, max_spread_counts=4, timeout_s=1.0) == 12.0


def test_tare_is_refused_when_the_probe_is_touched():
    with pytest.raises(LoadCellError, match="varies by 5 counts during tare, above the 4 allowed"):
        measure_tare(ScriptedCell(10, 12, 15), samples=3, max_spread_counts=4, timeout_s=1.0)


def test_tare_of_no_readings_is_refused():
    with pytest.raises(InvalidQuantity, match="samples is 0"):
        measure_tare(ScriptedCell(), samples=0, max_spread_counts=4, timeout_s=1.0)
