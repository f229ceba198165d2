"""Clients that harm: connections that never send or never read, and bodies of a hundred megabytes."""

from __future__ import annotations

import contextlib
import http.client
import socket
import threading
from collections.abc import Iterator

from daemon_process import WAIT_S

EVENTS = b"GET /api/v1/events HTTP/1.1\r\nhost: 127.0.0.1\r\n\r\n"
BODY_BYTES, PIECE, PAUSE_S = 100_000_000, bytes(64 * 1024), 0.2


@contextlib.contextmanager
def connections(url: str, count: int, sent: bytes) -> Iterator[list[socket.socket]]:
    """Open so many connections that send a beginning, and neither read nor send anything more."""
    port = int(url.rpartition(":")[2])
    with contextlib.ExitStack() as opened:
        lines = [opened.enter_context(socket.create_connection(("127.0.0.1", port), WAIT_S)) for _ in range(count)]
        for line in lines:
            line.sendall(sent)
        yield lines


@contextlib.contextmanager
def large_bodies(url: str) -> Iterator[list[int]]:
    """Send bodies of 100 MB one after the other, with their size said and without, until it ends; yield the answers."""
    answers, ending = list[int](), threading.Event()

    def sending() -> None:
        while not ending.wait(PAUSE_S):
            for says_its_size in (True, False):
                answers.append(_sent(url, says_its_size=says_its_size))

    thread = threading.Thread(target=sending)
    thread.start()
    try:
        yield answers
    finally:
        ending.set()
        thread.join()


def _sent(url: str, *, says_its_size: bool) -> int:
    """Return the status that a body got, 0 of a connection that was broken off."""
    connection = http.client.HTTPConnection(url.removeprefix("http://"), timeout=WAIT_S)
    headers = {"Content-Type": "application/json"} | ({"Content-Length": str(BODY_BYTES)} if says_its_size else {})
    pieces = (PIECE for _ in range(BODY_BYTES // len(PIECE)))
    try:
        connection.request("POST", "/api/v1/presses", pieces, headers, encode_chunked=not says_its_size)
        return connection.getresponse().status
    except (OSError, http.client.HTTPException):
        return 0
    finally:
        connection.close()
