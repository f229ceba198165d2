"""Lines of an OpenScale-like load cell amplifier to samples in ADC counts.

The amplifier streams `millis,reading,kg,raw24,` and CR LF, with "timestamp" and "raw reading" switched on in its menu.
`millis` tells when, however late the line is read; raw24 how much: `reading` is in the amplifier's own calibration.
Opening the port resets the amplifier, so the first two or three seconds are a banner. 9600 baud carries about 30 such
lines a second. Nothing is ever sent: an `x` would open the menu and stop the stream. A line that went is opened again
when it is back.
Without a bridge the converter reads an end of its range, or is read where none is: always the same number.
A firmware with the converter's library of before November 2015 sends offset binary: a bridge at rest is 8388608, and
the example in its source is 8355808. `millis` is a signed number of 32 bits there, negative from the 25th day on.
Of its load a reading is late: the converter settles within four conversions, so it shows the load of two before.
Source: SparkFun OpenScale firmware 1.2; HX711 datasheet (24-bit two's complement, input noise 50-90 nV = 20-40 counts,
settling 50 ms at 80 a second); bogde/HX711, issue 68.
"""

from __future__ import annotations

import math
import re
import time
from collections import deque

from device.errors import DetachedCellError, LoadCellError, SaturatedCellError, UnreadableCellError
from device.hardware.cell_line import CellLine
from device.hardware.interfaces import CellCounts, CellSample

LINE = re.compile(rb"(?P<millis>-?\d{1,10}),-?(?:\d+(?:\.\d+)?|nan|inf|ovf),(?:kg|lbs),(?P<raw24>-?\d{1,8}),\r?")
"""One line. Its reading, which nobody uses, is a word where the amplifier's own calibration is still 0, as in a blank
memory. A missing raw24 does not match."""
RAW24_LOW_COUNTS, RAW24_HIGH_COUNTS = -(2**23), 2**23 - 1
OFFSET_COUNTS = 2**23
"""What offset binary has for zero."""
MILLIS = 2**32
DELAY_S = 0.025
"""Two conversions at 80 a second."""
MOST_ALIKE = 20
"""A converter that is there makes this many equal readings running once in 10^30: its noise is tens of counts."""
MOST_DRIFT_RATIO = 0.01
"""How fast the sender's clock may lose on ours: a ceramic resonator's half per cent when new, and as much again by
temperature and age. One that loses more is stamped early by up to `RESTART_S`."""
RESTART_S = 0.5
"""A line this much earlier or later than the sender's clock lets expect comes from a clock that began anew."""


class OpenScale:
    """Reads an OpenScale-like stream from a serial line. Implements `LoadCell`."""

    def __init__(self, line: CellLine, *, is_offset_binary: bool = False, delay_s: float = DELAY_S) -> None:
        """Take a line, how its raw24 are coded, and by how much (s) a reading is later than the load that it shows."""
        self._line, self._name = line, line.name
        self._zero_counts, self._delay_s = OFFSET_COUNTS if is_offset_binary else 0, delay_s
        self._samples: deque[CellSample] = deque()
        self._clock = SenderClock()
        self._last_counts, self._alike = CellCounts(math.nan), 0
        self._unreadable_lines = 0
        self._last_unreadable = b""

    @property
    def pause_s(self) -> float:
        """How long (s) lines may gather before they are read: they say themselves when they were measured."""
        return self._line.pause_s

    @pause_s.setter
    def pause_s(self, pause_s: float) -> None:
        self._line.pause_s = pause_s

    @property
    def skipped_lines(self) -> int:
        """Lines that held no reading so far: banner, torn, garbage or too long."""
        return self._unreadable_lines + self._line.dropped_lines

    def read(self, *, timeout_s: float) -> CellSample:
        """Return the next reading (counts), waiting at most `timeout_s` for it.

        Raises `LoadCellError` when the line stays silent, `UnreadableCellError` when it holds only unreadable lines,
        `SaturatedCellError` when the reading is an end of the range, `DetachedCellError` when it never changes,
        `UnpluggedCellError` when the line is gone; the next call then tries to open it again.
        """
        skipped_before = self.skipped_lines
        deadline_s = time.monotonic() + timeout_s
        while not self._samples:
            if time.monotonic() >= deadline_s:
                raise self._no_reading(timeout_s, self.skipped_lines - skipped_before)
            for line in self._line.receive():
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
        self._line.close()

    def _keep(self, line: bytes, arrival_s: float) -> None:
        try:
            amplifier_s, counts = parse_reading(line, self._zero_counts)
            self._samples.append(CellSample(self._clock.measured_s(amplifier_s, arrival_s) - self._delay_s, counts))
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
        remedy = (
            "In its menu switch on timestamp and raw reading, switch off both temperatures, and set the configured "
            "baud rate."
        )
        if LINE.fullmatch(self._last_unreadable):
            remedy = (
                "At rest its raw reading is about 8388608 where it sends offset binary: cell.coding in the settings."
            )
        return UnreadableCellError(cause, remedy)


def parse_reading(line: bytes, zero_counts: int = 0) -> tuple[float, CellCounts]:
    """Return time (s, of the amplifier's clock) and raw24 (counts) of one line, without what stands for zero there.

    Raises `ValueError` when it is no complete reading.
    """
    match = LINE.fullmatch(line)
    if match is None:
        raise ValueError(f"{line!r} is not of the form millis,reading,kg,raw24,")
    counts = int(match["raw24"]) - zero_counts
    if not RAW24_LOW_COUNTS <= counts <= RAW24_HIGH_COUNTS:
        raise ValueError(f"{line!r} holds {counts} counts, outside 24 bit")
    return int(match["millis"]) % MILLIS / 1000, CellCounts(float(counts))


class SenderClock:
    """When a sender says it measured, on its own clock, to the one clock of the probe.

    A line is never early, only late: by the serial line, by a bus, by a busy board. So the least delay that was seen
    lately is the difference of the clocks, and what comes on top of it is lateness of that line alone.
    Source: the minimum filter of RFC 5905 (NTP), section 10; Zhang, Liu & Xia, IEEE INFOCOM 2002, on clocks that drift.
    """

    def __init__(self) -> None:
        self._ahead_s: float | None = None
        self._sender_s = self._measured_s = 0.0

    def measured_s(self, sender_s: float, arrival_s: float) -> float:
        """Return when a line was measured (s, our clock) that says `sender_s` and came at `arrival_s`.

        Never later than it came, and never before the line before it.
        """
        ahead_s = arrival_s - sender_s
        if self._ahead_s is None or sender_s < self._sender_s or abs(ahead_s - self._ahead_s) > RESTART_S:
            self._ahead_s = ahead_s
        else:
            self._ahead_s = min(ahead_s, self._ahead_s + MOST_DRIFT_RATIO * (sender_s - self._sender_s))
        self._sender_s = sender_s
        self._measured_s = min(arrival_s, max(self._measured_s, sender_s + self._ahead_s))
        return self._measured_s
