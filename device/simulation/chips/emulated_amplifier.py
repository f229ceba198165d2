"""What the emulated load cell amplifiers share: the bridge before them and the pseudo-terminal behind them.

The stream never waits for its reader: when too much is unread, lines are lost, as in an amplifier's own small buffer.
A cell that is plugged in again is another terminal under the same path, as udev's link makes it.

Its line may hang: the call that reads it does not return while the scenario says so. The kernel's own drivers can do
this, for instance while a USB port is being reset; no time limit of the reader helps.
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
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from device.simulation.faults import NO_FAULTS, FaultTimeline

OVERLOAD_COUNTS = 2**21
"""A load far above what the cell bears, and far below the end of any amplifier's range."""
MAX_UNREAD_BYTES = 512
GARBAGE_BYTES = 24
"""About one line's worth of what a wrong baud rate makes of it."""
UNPLUGGED_S = 0.01
"""How often an unplugged amplifier looks whether it is plugged in again."""


class EmulatedBridge:
    """Readings of `counts_at(t_s)` plus drift and Gaussian noise (counts).

    The zero drifts by `drift_counts_per_s` from the start on, as that of a cell that warms up.
    """

    def __init__(
        self,
        counts_at: Callable[[float], float],
        *,
        noise_counts: float,
        drift_counts_per_s: float = 0.0,
        seed: int,
        faults: FaultTimeline = NO_FAULTS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._counts_at, self._faults, self._since_s = counts_at, faults, clock()
        self._noise_counts, self._drift_counts_per_s = noise_counts, drift_counts_per_s
        self._noise = np.random.default_rng(seed)

    def counts(self, t_s: float) -> int:
        """Return the reading of a converter without ends at a time."""
        drift_counts = self._drift_counts_per_s * (t_s - self._since_s)
        counts = round(self._counts_at(t_s) + drift_counts + self._noise.normal(0.0, self._noise_counts))
        return counts + OVERLOAD_COUNTS if self._faults.is_active("cell_overloaded", t_s) else counts

    def garbage(self) -> bytes:
        """Return what a wrong baud rate makes of a line."""
        return self._noise.bytes(GARBAGE_BYTES)


class EmulatedAmplifier(ABC):
    """A thread behind a pseudo-terminal at `device_path`; closing is unplugging for good."""

    def __init__(
        self, bridge: EmulatedBridge, *, faults: FaultTimeline = NO_FAULTS, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._bridge, self._faults, self._clock = bridge, faults, clock
        self._folder = tempfile.TemporaryDirectory(prefix="tsis-force-")
        self._link = Path(self._folder.name) / "force"
        self.device_path = str(self._link)
        self._plug_in()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="load cell stream", daemon=True)
        self._thread.start()

    @abstractmethod
    def _power_up(self) -> None:
        """Do what the amplifier does when it gets its supply."""

    @abstractmethod
    def _work(self) -> None:
        """Do what it does while it has it: for a few hundredths of a second at most."""

    def close(self) -> None:
        """Take the line away: a reader then sees what unplugging shows."""
        if not self._ended.is_set():
            self._ended.set()
            self._thread.join()
            self._unplug()
            self._folder.cleanup()

    def _run(self) -> None:
        self._power_up()
        while not self._ended.is_set():
            if self._faults.is_active("cell_unplugged"):
                self._unplug()
                self._ended.wait(UNPLUGGED_S)
            elif not self._is_plugged:
                self._plug_in()
                self._power_up()
            else:
                self._work()

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

    def _send(self, line: bytes) -> None:
        # The terminal's own buffer holds seconds of lines; a late reader would take them for new ones.
        if self._unread_bytes() + len(line) <= MAX_UNREAD_BYTES:
            with suppress(BlockingIOError):  # the kernel may be late in passing on what it was given
                os.write(self._master, line)

    def _unread_bytes(self) -> int:
        answer = fcntl.ioctl(self._slave, termios.FIONREAD, struct.pack("i", 0))
        return int(struct.unpack("i", answer)[0])


class FreezingCell:
    """A `LoadCell` that reads another one, unless it is frozen."""

    def __init__(self, cell: Any, faults: FaultTimeline) -> None:
        self._cell, self._faults = cell, faults

    @property
    def pause_s(self) -> float:
        """That of the cell."""
        return float(self._cell.pause_s)

    @pause_s.setter
    def pause_s(self, pause_s: float) -> None:
        self._cell.pause_s = pause_s

    def read(self, *, timeout_s: float) -> Any:
        """Return the next sample of the cell; while it is frozen, do not return."""
        self._faults.hold_up("cell_frozen")
        return self._cell.read(timeout_s=timeout_s)

    def close(self) -> None:
        """Release the serial line."""
        self._cell.close()
