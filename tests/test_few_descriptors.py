"""A daemon that may open no more files: what it cannot do it says by a code, and it measures again when it can."""

from __future__ import annotations

import contextlib
import os
import resource

import pytest
from daemon_process import Daemon, wait_for
from hostile_clients import connections

pytestmark = [pytest.mark.real_time, pytest.mark.long]
SPARE, IDLE = 6, 12


def test_without_descriptors_a_press_ends_with_a_code_and_the_next_is_done(daemon: Daemon) -> None:
    assert daemon.press("quick")["state"] == "done"  # what a press loads is there
    pid = daemon.process.pid
    soft, hard = resource.prlimit(pid, resource.RLIMIT_NOFILE)
    asked = daemon.ask("/api/v1/presses", "POST", {"mode": "quick"})
    wait_for(lambda: daemon.ask(asked.headers["location"]).json["state"], lambda state: state == "capturing")
    opened = len(os.listdir(f"/proc/{pid}/fd"))
    resource.prlimit(pid, resource.RLIMIT_NOFILE, (opened + SPARE, hard))
    with contextlib.ExitStack() as idle:
        idle.enter_context(connections(daemon.url, IDLE, b"GET /api/v1/st"))
        wait_for(lambda: len(os.listdir(f"/proc/{pid}/fd")), lambda number: number >= opened + SPARE)
        job = daemon.ended(asked.headers["location"])  # it is answered when idle clients are let go
    resource.prlimit(pid, resource.RLIMIT_NOFILE, (soft, hard))
    assert job["state"] == "done" or job["code"] in ("E601", "E602")
    wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
    assert daemon.press("quick")["state"] == "done"
    kept = daemon.ask("/api/v1/measurements").json["measurements"]
    assert len(kept) == 2 + (job["state"] == "done")
