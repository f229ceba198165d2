"""A port that other machines cannot fill: connections are counted where they are taken, before anything is kept of one.

Under TLS a connection becomes one of the server's only once its handshake has ended; until then it holds a descriptor
and some hundred kilobytes, and whoever sends nothing would hold them for a minute. So a machine has a number of
connections, all other machines have one together, and a handshake ends soon. The own screen always gets in.
"""

from __future__ import annotations

import asyncio
import socket
from collections import Counter
from typing import Any

from device.access.known_hosts import is_loopback

MOST_OF_ONE, MOST_IN_ALL = 32, 128
"""Connections of other machines; a browser has six."""
HANDSHAKE_S = 10.0


class CountedPort(socket.socket):
    """A socket that listens, and closes at once what is one connection too many."""

    def __init__(self, listening: socket.socket) -> None:
        """Take over a socket that listens."""
        super().__init__(fileno=listening.detach())
        self.open = Counter[str]()

    def accept(self) -> tuple[socket.socket, Any]:
        """Return the next connection and its address; raises as `socket.accept`.

        And `BlockingIOError`, as if there were none, after one too many: what else waits has its turn first.
        """
        taken, address = super().accept()
        machine = str(address[0])
        if is_loopback(machine):
            return taken, address
        if self.open[machine] < MOST_OF_ONE and self.open.total() < MOST_IN_ALL:
            return _CountedConnection(taken, self.open, machine), address
        taken.close()
        raise BlockingIOError("one connection too many")


class _CountedConnection(socket.socket):
    """A connection that is counted until it is closed."""

    def __init__(self, taken: socket.socket, counted: Counter[str], machine: str) -> None:
        super().__init__(fileno=taken.detach())
        self._counted, self._machine, self._is_open = counted, machine, True
        counted[machine] += 1

    def close(self) -> None:
        if self._is_open:
            self._is_open = False
            self._counted[self._machine] -= 1
            if not self._counted[self._machine]:
                del self._counted[self._machine]  # else one entry a machine for ever
        super().close()


class ServerLoop(asyncio.SelectorEventLoop):
    """The event loop, whose servers end a handshake of TLS that does not go on: uvicorn has no setting for it."""

    async def create_server(self, *arguments: Any, ssl: Any = None, **named: Any) -> Any:
        """Serve as asyncio does."""
        if ssl is not None:
            named.setdefault("ssl_handshake_timeout", HANDSHAKE_S)
        return await super().create_server(*arguments, ssl=ssl, **named)
