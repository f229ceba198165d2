"""Load on the probe to the replies of a Mantracourt DCell or DSC, on a pseudo-terminal that real pyserial opens.

A station that is not asked, a broadcast and half a request get no reply at all; what cannot be read gets `?` and CR.
Request and reply take the time that their bytes take at the speed which the line was opened with.
Source: Mantracourt DCell & DSC user manual, appendix B (ASCII protocol) and STAT; what to check: docs/contracts.md.
"""

from __future__ import annotations

import os
import re
import select
import termios
import time
from collections.abc import Callable

from device.simulation.chips.emulated_amplifier import EmulatedAmplifier, EmulatedBridge
from device.simulation.faults import NO_FAULTS, FaultTimeline

REQUEST = re.compile(rb"!(?P<station>\d{3}):(?P<name>[A-Za-z0-9]{1,4})\?")
COUNTS_PER_MV_V = 1e6
RANGE_MV_V = 3.0
STAT_UNDER_RANGE, STAT_OVER_RANGE, STAT_INTEGRITY = 1 << 4, 1 << 5, 1 << 11
REFUSAL = b"?"
LISTEN_S = 0.02
BITS_A_BYTE = 10
"""8N1: with a start and a stop bit."""
BAUD = {
    termios.B9600: 9600,
    termios.B19200: 19_200,
    termios.B38400: 38_400,
    termios.B57600: 57_600,
    termios.B115200: 115_200,
    termios.B230400: 230_400,
}
"""Speeds of a unit, as a terminal names them."""


class EmulatedMantracourt(EmulatedAmplifier):
    """Answers for its bridge at one station; one count of the bridge is 1 nV/V."""

    def __init__(
        self,
        bridge: EmulatedBridge,
        *,
        station: int = 1,
        faults: FaultTimeline = NO_FAULTS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._station = station
        super().__init__(bridge, faults=faults, clock=clock)

    def _power_up(self) -> None:
        self._heard = b""

    def _work(self) -> None:
        readable, _, _ = select.select([self._master], [], [], LISTEN_S)
        if readable:
            *requests, self._heard = (self._heard + os.read(self._master, 256)).split(b"\r")
            for request in requests:
                reply = self._reply(request, self._clock())
                time.sleep((len(request) + 1 + len(reply)) * BITS_A_BYTE / self._baud)
                self._send(reply)

    @property
    def _baud(self) -> int:
        return BAUD.get(termios.tcgetattr(self._master)[5], max(BAUD.values()))

    def _reply(self, request: bytes, t_s: float) -> bytes:
        # A request begins at its "!", whatever the line held before.
        asked = REQUEST.fullmatch(request[max(0, request.rfind(b"!")) :])
        if not asked or int(asked["station"]) != self._station or self._faults.is_active("cell_silent", t_s):
            return b""
        if self._faults.is_active("cell_garbage", t_s):
            return self._bridge.garbage() + b"\r"
        mv_v, flags = self._reading(t_s)
        value = {b"MVV": mv_v, b"STAT": float(flags)}.get(asked["name"].upper())
        return (REFUSAL if value is None else f"{value:+013.6f}".encode()) + b"\r"

    def _reading(self, t_s: float) -> tuple[float, int]:
        """Return the bridge's mV/V and the flags that go with it."""
        mv_v = self._bridge.counts(t_s) / COUNTS_PER_MV_V
        if self._faults.is_active("cell_saturated", t_s):
            mv_v = 2 * RANGE_MV_V
        flags = (mv_v < -RANGE_MV_V) * STAT_UNDER_RANGE | (mv_v > RANGE_MV_V) * STAT_OVER_RANGE
        if self._faults.is_active("cell_disconnected", t_s):
            flags |= STAT_INTEGRITY
        return min(max(mv_v, -RANGE_MV_V), RANGE_MV_V), flags
