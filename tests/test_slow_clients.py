"""A hundred connections that never send and fifty that never read: a press is done beside them, and a stop is clean."""

from __future__ import annotations

import contextlib
import urllib.request

import pytest
from daemon_process import QUICK_HAND, Daemon
from hostile_clients import EVENTS, connections

pytestmark = pytest.mark.real_time
NEVER_SENDING, NEVER_READING, SCREENS = 100, 50, 10
MOST_GROWTH_MB = 30.0


def memory_mb(daemon: Daemon) -> float:
    with open(f"/proc/{daemon.process.pid}/statm") as file:
        return int(file.read().split()[1]) * 4096 / 1e6


@pytest.mark.long
def test_a_press_is_done_beside_clients_that_neither_send_nor_read(daemon):
    assert daemon.press("quick")["state"] == "done"  # what a press loads is there
    before_mb = memory_mb(daemon)
    with (
        connections(daemon.url, NEVER_SENDING // 2, b"") as silent,
        connections(daemon.url, NEVER_SENDING // 2, b"GET /api/v1/st") as halting,
        connections(daemon.url, NEVER_READING, EVENTS),
    ):
        assert daemon.press("quick")["state"] == "done"
        assert daemon.ask("/api/v1/health/ready").status == 200
        for line in (*silent, *halting):
            with contextlib.suppress(ConnectionResetError):
                assert line.recv(1) == b""  # the daemon has let it go
        assert daemon.press("quick")["state"] == "done"
        assert memory_mb(daemon) - before_mb < MOST_GROWTH_MB


def test_a_stop_ends_ten_streams_as_if_they_had_come_to_their_end(tmp_path):
    daemon = Daemon(tmp_path, QUICK_HAND)
    with contextlib.ExitStack() as opened:
        screens = [opened.enter_context(urllib.request.urlopen(daemon.url + "/api/v1/events")) for _ in range(SCREENS)]
        for screen in screens:
            assert screen.readline() == b"event: status\n"
        unread = opened.enter_context(connections(daemon.url, 1, EVENTS))
        daemon.process.terminate()
        for screen in screens:
            while screen.readline():
                pass  # no error: the stream ends
        assert unread
    assert daemon.ended_code() == 0
    log = daemon.log_text()
    assert "Traceback" not in log
    assert "ERROR" not in log
    assert log.count("route=/api/v1/events status=200") >= SCREENS
    assert "stop signal=SIGTERM" in log
