"""A serial port that may go and come back, to the lines that its amplifier sends.

The port need not be there yet. Nothing is kept across an unplugging: half a line from before must not be glued to the
first one after. Each call opens the port once if it is closed, so how often that is tried is the caller's to say.
Source: pyserial 3.5 (SerialException is an OSError; `in_waiting` of a port that is gone raises a plain OSError).
"""

from __future__ import annotations

import termios
import time
from collections.abc import Callable
from contextlib import suppress

import serial

from device.errors import UnpluggedCellError

MAX_LINE_BYTES = 256
POLL_S = 0.05
"""Longest wait for one byte: bounds how late a timeout is noticed."""
WRITE_S = 0.5
"""A request of a few bytes that is not taken in this time is stuck."""


class LineBuffer:
    """Cuts a byte stream into lines; keeps a partial line, drops a line that is too long."""

    def __init__(self, end: bytes = b"\n", max_bytes: int = MAX_LINE_BYTES) -> None:
        self._end, self._max_bytes = end, max_bytes
        self._partial, self._dropped_lines = b"", 0

    @property
    def dropped_lines(self) -> int:
        """Lines that were too long so far, with one that has not ended yet."""
        return self._dropped_lines + (len(self._partial) > self._max_bytes)

    def feed(self, data: bytes) -> list[bytes]:
        """Return the lines that are now complete, without their end."""
        *lines, partial = (self._partial + data).split(self._end)
        # One byte more than allowed is enough to know at its end that a line was too long.
        self._partial = partial[: self._max_bytes + 1]
        kept = [line for line in lines if len(line) <= self._max_bytes]
        self._dropped_lines += len(lines) - len(kept)
        return kept

    def clear(self) -> None:
        """Forget the partial line."""
        self._dropped_lines, self._partial = self.dropped_lines, b""


class CellLine:
    """The serial line of a load cell's amplifier."""

    def __init__(self, name: str, open_port: Callable[[], serial.Serial], *, end: bytes = b"\n") -> None:
        """Open the port; one that is missing or in use is for the next call to open. `end` ends a line."""
        self.name, self._open_port, self.pause_s = name, open_port, 0.0
        self._buffer = LineBuffer(end)
        self._port: serial.Serial | None = None
        with suppress(UnpluggedCellError):
            self._port = self._opened()

    @property
    def dropped_lines(self) -> int:
        """Lines that were too long so far."""
        return self._buffer.dropped_lines

    def receive(self) -> list[bytes]:
        """Return the lines that have become complete, waiting at most `POLL_S` for a byte after `pause_s`.

        Raises `UnpluggedCellError` when the port is missing, in use or gone; the next call then tries to open it again.
        """
        port = self._port = self._port or self._opened()
        if self.pause_s:
            time.sleep(self.pause_s)
        try:
            return self._buffer.feed(bytes(port.read(port.in_waiting or 1)))
        except OSError as error:
            raise self._gone(error) from error

    def send(self, request: bytes) -> None:
        """Send a request; what was received before is dropped, since it cannot be the answer.

        Raises `UnpluggedCellError` as `receive` does.
        """
        port = self._port = self._port or self._opened()
        try:
            port.reset_input_buffer()
            port.write(request)
        except (OSError, termios.error) as error:
            raise self._gone(error) from error
        self._buffer.clear()

    def close(self) -> None:
        """Release the serial line."""
        if self._port:
            self._port.close()
            self._port = None

    def _opened(self) -> serial.Serial:
        try:
            port = self._open_port()
            port.timeout, port.write_timeout = POLL_S, WRITE_S
        except (OSError, termios.error) as error:  # the latter when it goes again while it is being opened
            cause = f"Load cell port {self.name} cannot be opened: {error}."
            remedy = "Plug in the load cell and check its device path in the configuration."
            raise UnpluggedCellError(cause, remedy) from error
        return port

    def _gone(self, error: Exception) -> UnpluggedCellError:
        self.close()
        self._buffer.clear()
        return UnpluggedCellError(f"Load cell on {self.name} is gone: {error}.", "Plug its USB cable in again.")
