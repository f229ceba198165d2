"""A port for a program that a test starts as a process of its own."""

from __future__ import annotations

import random
import socket

_OWN = random.SystemRandom()
_BELOW_OUTGOING = range(15_000, 32_000)  # Linux takes 32768-60999 for outgoing connections: between the
# moment when such a port is found free and the program's start, a test beside may connect from it


def free_port() -> int:
    """Return a port that nobody has, and that no connection of a test beside is given."""
    while True:
        port = _OWN.choice(_BELOW_OUTGOING)
        with socket.socket() as one:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                one.bind(("127.0.0.1", port))
            except OSError:
                continue
        return port
