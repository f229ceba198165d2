"""Load on the probe to the bytes that an OpenScale streams, on a pseudo-terminal that real pyserial opens.

Source: SparkFun OpenScale firmware (banner, line format); HX711 datasheet (24 bit, saturating; a reading shows the load
of two conversions before, of 80 a second).
"""

from __future__ import annotations

import time
from collections.abc import Callable

from device.simulation.chips.emulated_amplifier import EmulatedAmplifier, EmulatedBridge
from device.simulation.faults import NO_FAULTS, FaultTimeline

BANNER = b"\r\nSerial Load Cell Converter version 1.2\r\nBy SparkFun Electronics\r\nReadings:\r\n"
COUNTS_PER_KG = 100_000.0
"""The amplifier's own calibration: only shows in the field that the driver does not use."""
FILTER_S = 0.025
RAW24_LOW_COUNTS, RAW24_HIGH_COUNTS, OFFSET_COUNTS = -(2**23), 2**23 - 1, 2**23


class EmulatedOpenScale(EmulatedAmplifier):
    """Streams a reading of its bridge `rate_hz` times a second."""

    def __init__(
        self,
        bridge: EmulatedBridge,
        *,
        rate_hz: float = 80.0,
        is_offset_binary: bool = False,
        faults: FaultTimeline = NO_FAULTS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._period_s = 1.0 / rate_hz
        self._zero_counts = OFFSET_COUNTS if is_offset_binary else 0
        super().__init__(bridge, faults=faults, clock=clock)

    def _power_up(self) -> None:
        self._send(BANNER)
        self._powered_s = self._next_s = self._clock()

    def _work(self) -> None:
        if not self._ended.wait(max(0.0, self._next_s - self._clock())):
            self._send(self._line())
            # A late thread skips readings, it does not send a burst of them.
            self._next_s = max(self._next_s + self._period_s, self._clock())

    def _line(self) -> bytes:
        """Return what the amplifier sends now: a reading, or what a fault makes of it."""
        t_s = self._clock()
        if self._faults.is_active("cell_silent", t_s):
            return b""
        if self._faults.is_active("cell_garbage", t_s):
            return self._bridge.garbage() + b"\n"
        counts = self._bridge.counts(t_s - FILTER_S)
        if self._faults.is_active("cell_saturated", t_s):
            counts = RAW24_HIGH_COUNTS
        if self._faults.is_active("cell_disconnected", t_s):
            counts = 0
        raw24 = min(max(counts, RAW24_LOW_COUNTS), RAW24_HIGH_COUNTS)
        sent = raw24 + self._zero_counts
        return f"{1000 * (t_s - self._powered_s):.0f},{raw24 / COUNTS_PER_KG:.4f},kg,{sent},\r\n".encode()
