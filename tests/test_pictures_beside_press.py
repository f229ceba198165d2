"""Eight clients fetch the pictures and recordings of precise presses while one is taken: neither feels the others."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from daemon_process import PATIENT, QUICK_HAND, Daemon

pytestmark = [pytest.mark.real_time, pytest.mark.long]
CLIENTS = 8
MORE_KB = 30_000
"""A precise press has 33 MB of frames, and a recording 11 MB: none of the clients may hold one of its own."""


def _memory_kb(daemon: Daemon, what: str) -> int:
    status = Path(f"/proc/{daemon.process.pid}/status").read_text()
    return int(status.partition(f"{what}:")[2].split()[0])


def _peak_of(daemon: Daemon, press: str) -> int:
    """Return the largest memory (kB) of the daemon during a press."""
    Path(f"/proc/{daemon.process.pid}/clear_refs").write_text("5")  # proc(5): the peak counts anew
    assert daemon.press(press)["state"] == "done"
    return _memory_kb(daemon, "VmHWM")


def test_a_press_is_taken_and_memory_stays_while_eight_clients_fetch(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path, PATIENT + QUICK_HAND)
    try:
        _peak_of(daemon, "precise")  # what a press takes is there
        alone_kb, before_kb = _peak_of(daemon, "precise"), _memory_kb(daemon, "VmRSS")
        kept = daemon.ask("/api/v1/measurements").json["measurements"]
        has_ended, sizes = threading.Event(), []

        def fetch(number: int) -> None:
            while not has_ended.is_set():
                for path in ("image.png", "recording.zip"):
                    answer = daemon.ask(f"/api/v1/measurements/{kept[number % len(kept)]['id']}/{path}")
                    assert answer.status == 200
                    sizes.append((path, len(answer.body)))

        with ThreadPoolExecutor(CLIENTS) as clients:
            fetches = [clients.submit(fetch, number) for number in range(CLIENTS)]
            try:
                beside_kb = _peak_of(daemon, "precise")
            finally:
                has_ended.set()
            for one in fetches:
                one.result()
        assert len(sizes) > 2 * CLIENTS
        assert min(size for path, size in sizes if path == "recording.zip") > 5_000_000
        assert beside_kb - alone_kb < MORE_KB, (alone_kb, beside_kb)
        assert _memory_kb(daemon, "VmRSS") - before_kb < MORE_KB, before_kb
    finally:
        daemon.stop()
