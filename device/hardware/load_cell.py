"""The load cell of the settings, opened, and the counts it reads when nothing touches the probe."""

from __future__ import annotations

import serial

from device.errors import LoadCellError
from device.hardware.cell_line import CellLine
from device.hardware.interfaces import CellCounts, LoadCell
from device.hardware.mantracourt import Mantracourt
from device.hardware.openscale import OpenScale
from device.measurement.quantities import Bound, require


def open_load_cell(device: str, baud: int = 9600, protocol: str = "openscale", station: int = 1) -> LoadCell:
    """Open the serial port for this program alone; raise `UnpluggedCellError` when it is missing or in use.

    `protocol` is "openscale" or "mantracourt"; only the latter has a `station`.
    """

    def open_port() -> serial.Serial:
        return serial.Serial(device, baudrate=baud, exclusive=True)

    if protocol == "mantracourt":
        return Mantracourt(CellLine(device, open_port, end=b"\r"), station)
    return OpenScale(CellLine(device, open_port))


def measure_tare(cell: LoadCell, *, samples: int, max_spread_counts: float, timeout_s: float) -> CellCounts:
    """Return the mean of `samples` readings (counts) of the unloaded probe; `timeout_s` is for each reading.

    Raises `LoadCellError` when largest minus smallest exceeds `max_spread_counts`: the probe was touched.
    """
    action = "ask for at least one reading and a positive spread"
    require("samples", samples, Bound(1, 100_000, ""), action)
    require("max_spread_counts", max_spread_counts, Bound(0.0, 2.0**24, "counts", low_included=False), action)
    counts = [cell.read(timeout_s=timeout_s).counts for _ in range(samples)]
    spread_counts = max(counts) - min(counts)
    if spread_counts > max_spread_counts:
        cause = f"Load cell varies by {spread_counts:g} counts during tare, above the {max_spread_counts:g} allowed."
        raise LoadCellError(cause, "Hold the probe free and still, and tare again.")
    return CellCounts(sum(counts) / samples)
