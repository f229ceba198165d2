"""Load on the probe to the bytes of its amplifier, on a pseudo-terminal that real pyserial opens.

The stream never waits for its reader: when too much is unread, lines are lost, as in the amplifier's own small buffer.
Source: SparkFun OpenScale firmware (banner, line format); HX711 datasheet (24 bit, saturating).
"""

from __future__ import annotations

import fcntl
import os
import struct
import termios
import threading
import time
import tty
from collections.abc import Callable

import numpy as np

BANNER = b"\r\nSerial Load Cell Converter version 1.2\r\nBy SparkFun Electronics\r\nReadings:\r\n"
COUNTS_PER_KG = 100_000.0
"""The amplifier's own calibration: only shows in the field that the driver does not use."""
RAW24_LOW_COUNTS, RAW24_HIGH_COUNTS = -(2**23), 2**23 - 1
MAX_UNREAD_BYTES = 512


class EmulatedOpenScale:
    """Streams readings of `counts_at(t_s)` plus Gaussian noise (counts) until closed; closing is unplugging."""

    def __init__(
        self,
        counts_at: Callable[[float], float],
        *,
        rate_hz: float = 80.0,
        noise_counts: float,
        seed: int,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._counts_at = counts_at
        self._period_s = 1.0 / rate_hz
        self._noise_counts = noise_counts
        self._noise = np.random.default_rng(seed)
        self._clock = clock
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.device_path = os.ttyname(self._slave)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._stream, name="load cell stream", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the stream and take the line away: a reader then sees what unplugging shows."""
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            os.close(self._slave)
            os.close(self._master)

    def _stream(self) -> None:
        self._send(BANNER)
        start_s = next_s = self._clock()
        while not self._ended.wait(max(0.0, next_s - self._clock())):
            self._send(self._line(start_s))
            # A late thread skips readings, it does not send a burst of them.
            next_s = max(next_s + self._period_s, self._clock())

    def _line(self, start_s: float) -> bytes:
        t_s = self._clock()
        counts = round(self._counts_at(t_s) + self._noise.normal(0.0, self._noise_counts))
        raw24 = min(max(counts, RAW24_LOW_COUNTS), RAW24_HIGH_COUNTS)
        return f"{1000 * (t_s - start_s):.0f},{raw24 / COUNTS_PER_KG:.4f},kg,{raw24},\r\n".encode()

    def _send(self, line: bytes) -> None:
        # The terminal's own buffer holds seconds of lines; a late reader would take them for new ones.
        if self._unread_bytes() + len(line) <= MAX_UNREAD_BYTES:
            os.write(self._master, line)

    def _unread_bytes(self) -> int:
        answer = fcntl.ioctl(self._slave, termios.FIONREAD, struct.pack("i", 0))
        return int(struct.unpack("i", answer)[0])
