"""Load on the probe to the bytes of its amplifier, on a pseudo-terminal that real pyserial opens.

The stream never waits for its reader: when too much is unread, lines are lost, as in the amplifier's own small buffer.
A cell that is plugged in again is another terminal under the same path, as udev's link makes it.
Source: SparkFun OpenScale firmware (banner, line format); HX711 datasheet (24 bit, saturating).
"""

from __future__ import annotations

import fcntl
import os
import struct
import tempfile
import termios
import threading
import time
import tty
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from device.simulation.faults import NO_FAULTS, FaultTimeline

BANNER = b"\r\nSerial Load Cell Converter version 1.2\r\nBy SparkFun Electronics\r\nReadings:\r\n"
COUNTS_PER_KG = 100_000.0
"""The amplifier's own calibration: only shows in the field that the driver does not use."""
RAW24_LOW_COUNTS, RAW24_HIGH_COUNTS = -(2**23), 2**23 - 1
OVERLOAD_COUNTS = 2**22
"""A load far above what the cell bears, and far below the end of its range."""
MAX_UNREAD_BYTES = 512
GARBAGE_BYTES = 24
"""About one line's worth of what a wrong baud rate makes of it."""


class EmulatedOpenScale:
    """Streams readings of `counts_at(t_s)` plus drift and Gaussian noise (counts); closing is unplugging for good.

    The zero drifts by `drift_counts_per_s` from the start on, as that of a cell that warms up.
    """

    def __init__(
        self,
        counts_at: Callable[[float], float],
        *,
        rate_hz: float = 80.0,
        noise_counts: float,
        drift_counts_per_s: float = 0.0,
        seed: int,
        faults: FaultTimeline = NO_FAULTS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._counts_at = counts_at
        self._period_s = 1.0 / rate_hz
        self._noise_counts, self._drift_counts_per_s = noise_counts, drift_counts_per_s
        self._noise = np.random.default_rng(seed)
        self._faults, self._clock, self._since_s = faults, clock, clock()
        self._folder = tempfile.TemporaryDirectory(prefix="tsis-force-")
        self._link = Path(self._folder.name) / "force"
        self.device_path = str(self._link)
        self._plug_in()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._stream, name="load cell stream", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the stream and take the line away: a reader then sees what unplugging shows."""
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            self._unplug()
            self._folder.cleanup()

    def _plug_in(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._link.symlink_to(os.ttyname(self._slave))
        self._is_plugged = True

    def _unplug(self) -> None:
        if self._is_plugged:
            self._is_plugged = False
            self._link.unlink()
            os.close(self._slave)
            os.close(self._master)

    def _stream(self) -> None:
        self._send(BANNER)
        powered_s = next_s = self._clock()
        while not self._ended.wait(max(0.0, next_s - self._clock())):
            if self._faults.is_active("cell_unplugged"):
                self._unplug()
            elif not self._is_plugged:
                self._plug_in()
                self._send(BANNER)
                powered_s = self._clock()
            else:
                self._send(self._line(powered_s))
            # A late thread skips readings, it does not send a burst of them.
            next_s = max(next_s + self._period_s, self._clock())

    def _line(self, powered_s: float) -> bytes:
        """Return what the amplifier sends now: a reading, or what a fault makes of it."""
        t_s = self._clock()
        if self._faults.is_active("cell_silent", t_s):
            return b""
        if self._faults.is_active("cell_garbage", t_s):
            return self._noise.bytes(GARBAGE_BYTES) + b"\n"
        drift_counts = self._drift_counts_per_s * (t_s - self._since_s)
        counts = round(self._counts_at(t_s) + drift_counts + self._noise.normal(0.0, self._noise_counts))
        if self._faults.is_active("cell_overloaded", t_s):
            counts += OVERLOAD_COUNTS
        if self._faults.is_active("cell_saturated", t_s):
            counts = RAW24_HIGH_COUNTS
        if self._faults.is_active("cell_disconnected", t_s):
            counts = 0
        raw24 = min(max(counts, RAW24_LOW_COUNTS), RAW24_HIGH_COUNTS)
        return f"{1000 * (t_s - powered_s):.0f},{raw24 / COUNTS_PER_KG:.4f},kg,{raw24},\r\n".encode()

    def _send(self, line: bytes) -> None:
        # The terminal's own buffer holds seconds of lines; a late reader would take them for new ones.
        if self._unread_bytes() + len(line) <= MAX_UNREAD_BYTES:
            with suppress(BlockingIOError):  # the kernel may be late in passing on what it was given
                os.write(self._master, line)

    def _unread_bytes(self) -> int:
        answer = fcntl.ioctl(self._slave, termios.FIONREAD, struct.pack("i", 0))
        return int(struct.unpack("i", answer)[0])
