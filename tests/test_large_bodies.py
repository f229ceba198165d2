"""Forty megabytes sent to a running probe: refused, never held in memory, and the press under way does not notice."""

from __future__ import annotations

import http.client
import json
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from daemon_process import Daemon, wait_for

pytestmark = pytest.mark.real_time
PIECE = b'{"mode": "quick"}, ' * 3400
PIECES = 40_000_000 // len(PIECE)


def pieces() -> Iterator[bytes]:
    yield from (PIECE for _ in range(PIECES))


def send(daemon: Daemon, *, says_its_size: bool) -> tuple[int, str, str]:
    """Send it all, as a client does that reads the answer afterwards; return status, content type and code."""
    connection = http.client.HTTPConnection(daemon.url.removeprefix("http://"), timeout=60)
    headers = {"Content-Type": "application/json"}
    if says_its_size:
        headers["Content-Length"] = str(PIECES * len(PIECE))
    connection.request("POST", "/api/v1/presses", pieces(), headers, encode_chunked=not says_its_size)
    answer = connection.getresponse()
    found = answer.status, str(answer.getheader("content-type")), json.loads(answer.read())["code"]
    connection.close()
    return found


def most_memory_mb(daemon: Daemon) -> float:
    """Return the most memory that the daemon has ever had."""
    text = Path(f"/proc/{daemon.process.pid}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+) kB", text)[1]) / 1024


@pytest.mark.parametrize("says_its_size", [True, False])
def test_it_is_refused_and_never_held_in_memory(daemon, says_its_size):
    before_mb = most_memory_mb(daemon)
    assert send(daemon, says_its_size=says_its_size) == (413, "application/problem+json", "E809")
    assert most_memory_mb(daemon) - before_mb < 10


def test_the_press_under_way_does_not_notice(daemon):
    """It used to fail with "check its cable": the event loop was busy for as long as the load cell may be silent."""
    location = daemon.ask("/api/v1/presses", "POST", {}).headers["location"]
    wait_for(lambda: daemon.ask(location).json, lambda job: job["state"] == "capturing")
    for says_its_size in (True, False):
        assert send(daemon, says_its_size=says_its_size)[0] == 413
    assert daemon.ask(location).json["state"] in ("capturing", "computing", "done")
    assert daemon.ended(location)["state"] == "done"
