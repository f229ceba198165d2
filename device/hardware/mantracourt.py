"""Replies of a Mantracourt DCell or DSC strain gauge converter (ASCII protocol) to samples in counts of 1 nV/V.

It never speaks unasked: `!001:MVV?` CR asks station 1 for what its bridge gives in mV/V, `!001:STAT?` CR whether that
is to be trusted. Not SYS: the unit's own zero is taken off that, and would hide a load. A reply does not say what it
answers; so one request is under way at a time, what comes unasked is dropped, and both replies are of one length.
Source: Mantracourt DCell & DSC user manual, appendix B (ASCII protocol, 50 ms), STAT, DP and DPB.
"""

from __future__ import annotations

import re
import time

from device.errors import DetachedCellError, LoadCellError, SaturatedCellError, UnreadableCellError
from device.hardware.cell_line import CellLine
from device.hardware.interfaces import CellCounts, CellSample

COUNTS_PER_MV_V = 1e6
REPLY = re.compile(rb"[+-]\d{1,8}\.\d{6,8}")
"""Sign, DPB digits, DP digits; fewer than six decimals would be coarser than a count."""
STAT_UNDER_RANGE, STAT_OVER_RANGE, STAT_INTEGRITY = 1 << 4, 1 << 5, 1 << 11
"""Not yet tried on a unit; docs/contracts.md says what to check at commissioning."""
REPLY_S = 0.15
"""The unit answers within 50 ms or not at all; the rest is for 9600 baud and a USB converter."""
PERIOD_S = 0.0125


class Mantracourt:
    """Asks one station on a serial line for its bridge, 80 times a second at most. Implements `LoadCell`."""

    def __init__(self, line: CellLine, station: int) -> None:
        """Take a line whose lines end in CR, and the station (1-999; 0 would be a broadcast, which none answers)."""
        self._line, self._station = line, station
        self._next_s, self.pause_s = time.monotonic(), 0.0
        self._skipped, self._last_skipped = 0, b""

    @property
    def skipped_lines(self) -> int:
        """Lines that were no reply so far: an echo of the request, a refusal (`?`), garbage, torn or too long."""
        return self._skipped + self._line.dropped_lines

    def read(self, *, timeout_s: float) -> CellSample:
        """Return the next reading (counts), waiting at most `timeout_s` for it.

        Raises `LoadCellError` when the station stays silent, `UnreadableCellError` when it sends only what is no reply,
        `DetachedCellError` when it misses its bridge, `SaturatedCellError` when the bridge is out of its range,
        `UnpluggedCellError` when the line is gone; the next call then tries to open it again.
        """
        time.sleep(max(0.0, self._next_s - time.monotonic()))
        self._next_s = time.monotonic() + max(PERIOD_S, self.pause_s)
        deadline_s, skipped_before = time.monotonic() + timeout_s, self.skipped_lines
        while (answer := self._bridge_and_flags()) is None:
            if time.monotonic() >= deadline_s:
                raise self._no_reading(timeout_s, self.skipped_lines - skipped_before)
        sample, flags = answer
        self._require_working(flags)
        return sample

    def close(self) -> None:
        """Release the serial line."""
        self._line.close()

    def _bridge_and_flags(self) -> tuple[CellSample, int] | None:
        """Return a reading and the flags asked for after it, or None when either reply is missing or torn."""
        bridge = self._ask("MVV")
        t_s = time.monotonic()
        flags = self._ask("STAT") if bridge else None
        if bridge is None or flags is None:
            return None
        if len(bridge) != len(flags) or not float(flags).is_integer():
            self._skip(bridge)
            return None
        return CellSample(t_s, CellCounts(float(bridge) * COUNTS_PER_MV_V)), int(float(flags))

    def _ask(self, name: str) -> bytes | None:
        self._line.send(f"!{self._station:03d}:{name}?\r".encode())
        deadline_s = time.monotonic() + REPLY_S
        while time.monotonic() < deadline_s:
            for line in self._line.receive():
                if REPLY.fullmatch(line):
                    return line
                self._skip(line)
        return None

    def _skip(self, line: bytes) -> None:
        self._skipped += 1
        self._last_skipped = line

    def _require_working(self, flags: int) -> None:
        if flags & STAT_INTEGRITY:
            cause = f"Load cell on {self._line.name} misses its bridge (STAT {flags})."
            raise DetachedCellError(cause, "Check the load cell's wires; if it stays, have it replaced.")
        if flags & (STAT_UNDER_RANGE | STAT_OVER_RANGE):
            cause = f"Load cell on {self._line.name} is at the end of its range (STAT {flags})."
            raise SaturatedCellError(cause, "Take the load off the probe; if it stays, check the cell's wires.")

    def _no_reading(self, timeout_s: float, skipped: int) -> LoadCellError:
        who = f"Load cell, station {self._station} on {self._line.name},"
        if skipped == 0:
            cause = f"{who} has answered nothing for {timeout_s:g} s."
            return LoadCellError(cause, "Check its cable and supply, and the configured station and baud rate.")
        cause = f"{who} gave no reading for {timeout_s:g} s: {skipped} lines skipped, the last {self._last_skipped!r}."
        return UnreadableCellError(cause, "Set its DP to 6 and its DPB to 5, and the configured baud rate.")
