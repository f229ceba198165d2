"""Lines of the load cell's amplifier to samples in ADC counts.

The amplifier streams `millis,reading,kg,raw24,` and CR LF, with "timestamp" and "raw reading" switched on in its menu.
Only raw24 is used: `reading` is in the amplifier's own calibration. Opening the port resets the amplifier, so the
first two or three seconds are a banner. 9600 baud carries about 30 such lines a second. Nothing is ever sent:
an `x` would open the menu and stop the stream. A line that went is opened again when it is back.
Without a bridge the converter reads an end of its range, or is read where none is: always the same number.
Source: SparkFun OpenScale firmware; HX711 datasheet (24-bit two's complement, input noise 50-90 nV = 20-40 counts).
"""

from __future__ import annotations

import math
import re
import termios
import time
from collections import deque
from collections.abc import Callable

import serial

from device.errors import (
    DetachedCellError,
    LoadCellError,
    SaturatedCellError,
    UnpluggedCellError,
    UnreadableCellError,
)
from device.hardware.interfaces import CellCounts, CellSample, LoadCell
from device.measurement.quantities import Bound, require

LINE = re.compile(rb"\d+,-?\d+(?:\.\d+)?,(?:kg|lbs),(?P<raw24>-?\d{1,7}),\r?")
"""One reading. A missing raw24 does not match, and neither do the words nan, inf and ovf."""
RAW24_LOW_COUNTS, RAW24_HIGH_COUNTS = -(2**23), 2**23 - 1
MOST_ALIKE = 20
"""A converter that is there makes this many equal readings running once in 10^30: its noise is tens of counts."""
MAX_LINE_BYTES = 256
POLL_S = 0.05
"""Longest wait for one byte: bounds how late a timeout is noticed."""


class LineBuffer:
    """Cuts a byte stream into lines; keeps a partial line, drops a line that is too long."""

    def __init__(self, max_bytes: int = MAX_LINE_BYTES) -> None:
        self._max_bytes = max_bytes
        self._partial = b""
        self.dropped_lines = 0

    def feed(self, data: bytes) -> list[bytes]:
        """Return the lines that are now complete, without their line feed."""
        *lines, partial = (self._partial + data).split(b"\n")
        # One byte more than allowed is enough to know at its end that a line was too long.
        self._partial = partial[: self._max_bytes + 1]
        kept = [line for line in lines if len(line) <= self._max_bytes]
        self.dropped_lines += len(lines) - len(kept)
        return kept


def parse_counts(line: bytes) -> CellCounts:
    """Return raw24 (counts) of one line; raise `ValueError` when it is no complete reading."""
    match = LINE.fullmatch(line)
    if match is None:
        raise ValueError(f"{line!r} is not of the form millis,reading,kg,raw24,")
    counts = int(match["raw24"])
    if not RAW24_LOW_COUNTS <= counts <= RAW24_HIGH_COUNTS:
        raise ValueError(f"{line!r} holds {counts} counts, outside 24 bit")
    return CellCounts(float(counts))


class OpenScale:
    """Reads an OpenScale-like stream from a serial port. Implements `LoadCell`."""

    def __init__(self, name: str, open_port: Callable[[], serial.Serial]) -> None:
        """Open the port; raise `UnpluggedCellError` when it is missing or in use."""
        self._name, self._open_port = name, open_port
        self._port: serial.Serial | None = self._opened()
        self._buffer = LineBuffer()
        self._samples: deque[CellSample] = deque()
        self._last_counts, self._alike = CellCounts(math.nan), 0
        self._unreadable_lines = 0
        self._last_unreadable = b""

    @property
    def skipped_lines(self) -> int:
        """Lines that held no reading since the port was opened: banner, torn, garbage or too long."""
        return self._unreadable_lines + self._buffer.dropped_lines

    def read(self, *, timeout_s: float) -> CellSample:
        """Return the next reading (counts), waiting at most `timeout_s` for it.

        Raises `LoadCellError` when the line stays silent, `UnreadableCellError` when it holds only unreadable lines,
        `SaturatedCellError` when the reading is an end of the range, `DetachedCellError` when it never changes,
        `UnpluggedCellError` when the line is gone; the next call then tries to open it again.
        """
        self._port = self._port or self._opened()
        skipped_before = self.skipped_lines
        deadline_s = time.monotonic() + timeout_s
        while not self._samples:
            if time.monotonic() >= deadline_s:
                raise self._no_reading(timeout_s, self.skipped_lines - skipped_before)
            for line in self._buffer.feed(self._receive()):
                self._keep(line, time.monotonic())
        sample = self._samples.popleft()
        try:
            self._require_working(sample.counts)
        except LoadCellError:
            self._samples.clear()  # those behind it are as old as the wait for them will be long
            raise
        return sample

    def close(self) -> None:
        """Release the serial line."""
        if self._port:
            self._port.close()
            self._port = None

    def _opened(self) -> serial.Serial:
        try:
            port = self._open_port()
            port.timeout = POLL_S
        except (OSError, termios.error) as error:  # the latter when it goes again while it is being opened
            cause = f"Load cell port {self._name} cannot be opened: {error}."
            remedy = "Plug in the load cell and check its device path in the configuration."
            raise UnpluggedCellError(cause, remedy) from error
        return port

    def _receive(self) -> bytes:
        assert self._port  # read() has opened it
        try:
            return bytes(self._port.read(self._port.in_waiting or 1))
        except OSError as error:  # SerialException is one; `in_waiting` of an unplugged port raises a plain one
            self.close()
            self._buffer = LineBuffer()
            raise UnpluggedCellError(
                f"Load cell on {self._name} is gone: {error}.", "Plug its USB cable in again."
            ) from error

    def _keep(self, line: bytes, t_s: float) -> None:
        try:
            self._samples.append(CellSample(t_s, parse_counts(line)))
        except ValueError:
            self._unreadable_lines += 1
            self._last_unreadable = line

    def _require_working(self, counts: CellCounts) -> None:
        if not RAW24_LOW_COUNTS < counts < RAW24_HIGH_COUNTS:
            cause = f"Load cell on {self._name} reads {counts:.0f} counts, the end of its range."
            raise SaturatedCellError(cause, "Take the load off the probe; if it stays, check the cell's four wires.")
        self._alike = self._alike + 1 if counts == self._last_counts else 1
        self._last_counts = counts
        if self._alike >= MOST_ALIKE:
            cause = f"Load cell on {self._name} has read {counts:.0f} counts {self._alike} times running."
            raise DetachedCellError(cause, "Plug the load cell into its amplifier; if it stays, have it replaced.")

    def _no_reading(self, timeout_s: float, skipped: int) -> LoadCellError:
        if skipped == 0:
            cause = f"Load cell on {self._name} has sent nothing for {timeout_s:g} s."
            return LoadCellError(cause, "Check its cable and supply, and that its menu is closed.")
        cause = (
            f"Load cell on {self._name} gave no reading for {timeout_s:g} s: {skipped} lines skipped, "
            f"the last {self._last_unreadable!r}."
        )
        return UnreadableCellError(
            cause, "Switch on timestamp and raw reading in its menu, and set the configured baud rate."
        )


def open_load_cell(device: str, baud: int = 9600) -> OpenScale:
    """Open the serial port for this program alone; raise `UnpluggedCellError` when it is missing or in use."""
    return OpenScale(device, lambda: serial.Serial(device, baudrate=baud, exclusive=True))


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
