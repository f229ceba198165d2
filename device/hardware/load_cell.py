"""The load cell of the settings, opened, and the counts it reads when nothing touches the probe."""

from __future__ import annotations

from collections.abc import Callable

import serial

from device.errors import SlowCellError, UnsteadyTareError
from device.hardware.cell_line import CellLine
from device.hardware.interfaces import CellCounts, CellSample, LoadCell
from device.hardware.mantracourt import Mantracourt
from device.hardware.openscale import DELAY_S, OpenScale
from device.measurement.quantities import Bound, require

LEAST_RATE_HZ = 15.0
"""Three readings in the 0.15 s by which a steady hand is told: an OpenScale as it is delivered gives five a second, and
one that averages four ten. A Mantracourt at 9600 baud gives some twenty."""


def open_load_cell(
    device: str,
    baud: int = 9600,
    protocol: str = "openscale",
    station: int = 1,
    *,
    coding: str = "twos_complement",
    delay_s: float = DELAY_S,
) -> LoadCell:
    """Open the serial port for this program alone, or let the first read do so that finds it plugged in.

    `protocol` is "openscale" or "mantracourt"; only the latter has a `station`, and only the former the last two.
    """

    def open_port() -> serial.Serial:
        return serial.Serial(device, baudrate=baud, exclusive=True)

    if protocol == "mantracourt":
        return Mantracourt(CellLine(device, open_port, end=b"\r"), station)
    return OpenScale(CellLine(device, open_port), is_offset_binary=coding == "offset_binary", delay_s=delay_s)


def measure_tare(read: Callable[[], CellSample], *, samples: int, max_spread_counts: float) -> CellCounts:
    """Return the mean of `samples` readings (counts) of the unloaded probe, each of them by `read`.

    Raises `UnsteadyTareError` when largest minus smallest exceeds `max_spread_counts`: the probe was touched. And
    `SlowCellError` when there were fewer than `LEAST_RATE_HZ` a second.
    """
    action = "ask for at least one reading and a positive spread"
    require("samples", samples, Bound(1, 100_000, ""), action)
    require("max_spread_counts", max_spread_counts, Bound(0.0, 2.0**24, "counts", low_included=False), action)
    readings = [read() for _ in range(samples)]
    took_s, counts = readings[-1].t_s - readings[0].t_s, [one.counts for one in readings]
    if took_s * LEAST_RATE_HZ > samples - 1:
        cause = f"Load cell gives {(samples - 1) / took_s:.3g} readings a second, fewer than {LEAST_RATE_HZ:g}."
        raise SlowCellError(
            cause,
            "Set its amplifier to its fastest rate, to no averaging, and a mantracourt's line to 38400 baud or more.",
        )
    spread_counts = max(counts) - min(counts)
    if spread_counts > max_spread_counts:
        cause = f"Load cell varies by {spread_counts:g} counts during tare, above the {max_spread_counts:g} allowed."
        raise UnsteadyTareError(cause, "Lift the probe and let nothing touch it, until it is ready.")
    return CellCounts(sum(counts) / samples)
