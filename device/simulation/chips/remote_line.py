"""A GPIO line behind a Unix socket: the LED chip is here, and who drives its enable line is another process.

One process at a time has the line, as the kernel gives it; when that process ends or lets it go, the line falls, as a
resistor at the chip pulls it. A raised line is up when `switch` returns; a lowered one falls without waiting for
whoever holds the chip: that may be a frozen process.
Source: Linux' GPIO character device, Documentation/userspace-api/gpio/chardev.rst.
"""

from __future__ import annotations

import errno
import os
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory

UP, DOWN, DONE, BUSY = b"1", b"0", b"d", b"b"


class LineServer:
    """The line's end at the chip: `obey` is called with each level, from a thread of the line's own."""

    def __init__(self, obey: Callable[[bool], None], is_busy: Callable[[], bool] = lambda: False) -> None:
        """Serve the line at `address`, low; `is_busy` says that a process beside ours has it."""
        self._obey, self._is_busy, self._taken = obey, is_busy, threading.Lock()
        self._folder = TemporaryDirectory(prefix="tsis-")
        self.address = str(Path(self._folder.name) / "line")
        self._listening = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._listening.bind(self.address)
        self._listening.listen()
        obey(False)
        threading.Thread(target=self._accept, name="enable line", daemon=True).start()

    def close(self) -> None:
        """Take the line away."""
        with suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()
        self._folder.cleanup()

    def _accept(self) -> None:
        with suppress(OSError):  # closed
            while True:
                connection = self._listening.accept()[0]
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with connection, suppress(ConnectionError):
            if self._is_busy() or not self._taken.acquire(timeout=0.1):  # whoever has just ended is leaving
                connection.send(BUSY)
                return
            try:
                connection.send(DONE)
                while level := connection.recv(1):
                    self._obey(level == UP)
                    if level == UP:
                        connection.send(DONE)
            finally:
                self._obey(False)
                self._taken.release()


class RemoteLine:
    """The same line in the process that drives it."""

    def __init__(self, address: str) -> None:
        """Ask for the line, low; raise `OSError` as the kernel does when another has it."""
        self._connection = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._connection.connect(address)
        if self._connection.recv(1) != DONE:
            self._connection.close()
            raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))

    def switch(self, is_up: bool) -> None:
        """Set the line's level."""
        self._connection.send(UP if is_up else DOWN)
        if is_up:
            self._connection.recv(1)

    def close(self) -> None:
        """Release the line: it falls."""
        self._connection.close()
