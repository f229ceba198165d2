"""Eight clients fetch the pictures and recordings of precise presses while one is taken: neither feels the others."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from daemon_process import PATIENT, QUICK_HAND, Daemon

pytestmark = [pytest.mark.real_time, pytest.mark.long]
CLIENTS = 8
FETCHES_BEFORE_PRESS = 6 * CLIENTS
FETCHING_KB = 15_000
"""Eight recordings of 8 MB are 64 MB: no client may make the daemon hold its own."""
WAITING_KB = 26_000
"""The frames of a scan: beside eight clients they may wait for their encoding while the answer is sampled."""


def _memory_kb(daemon: Daemon, what: str) -> int:
    status = Path(f"/proc/{daemon.process.pid}/status").read_text()
    return int(status.partition(f"{what}:")[2].split()[0])


def _start_peak(daemon: Daemon) -> int:
    """Count the peak of the daemon's memory anew (proc(5)) and return what it holds now (kB)."""
    Path(f"/proc/{daemon.process.pid}/clear_refs").write_text("5")
    return _memory_kb(daemon, "VmRSS")


def _peak_of(daemon: Daemon, press: str) -> int:
    """Return the largest memory (kB) of the daemon during a press."""
    _start_peak(daemon)
    assert daemon.press(press)["state"] == "done"
    return _memory_kb(daemon, "VmHWM")


def _with_spread(of_each_kb: list[int]) -> int:
    """Return what a fourth may take by itself: as much above the largest of three as these differ."""
    return 2 * max(of_each_kb) - min(of_each_kb)


def test_a_press_is_taken_and_memory_stays_while_eight_clients_fetch(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path, PATIENT + QUICK_HAND)
    try:
        # One press takes up to 55 MB more than the next without any client, and leaves up to 40 MB more.
        each_kb = [(_peak_of(daemon, "precise"), _memory_kb(daemon, "VmRSS")) for _ in range(3)]
        alone_kb, left_kb = (_with_spread(list(of_each_kb)) for of_each_kb in zip(*each_kb, strict=True))
        kept = daemon.ask("/api/v1/measurements").json["measurements"]
        has_fetched, has_ended, sizes = threading.Event(), threading.Event(), []

        def fetch(number: int) -> None:
            while not has_ended.is_set():
                for path in ("image.png", "recording.zip"):
                    answer = daemon.ask(f"/api/v1/measurements/{kept[number % len(kept)]['id']}/{path}")
                    assert answer.status == 200
                    sizes.append((path, len(answer.body)))
                    if len(sizes) >= FETCHES_BEFORE_PRESS:
                        has_fetched.set()

        with ThreadPoolExecutor(CLIENTS) as clients:
            before_kb = _start_peak(daemon)
            fetches = [clients.submit(fetch, number) for number in range(CLIENTS)]
            try:
                assert has_fetched.wait(60)
                fetching_kb = _memory_kb(daemon, "VmHWM")
                beside_kb = _peak_of(daemon, "precise")
            finally:
                has_ended.set()
            for one in fetches:
                one.result()
        assert len(sizes) > 2 * CLIENTS
        assert min(size for path, size in sizes if path == "recording.zip") > 5_000_000
        assert fetching_kb - before_kb < FETCHING_KB, (before_kb, fetching_kb)
        assert beside_kb - alone_kb < WAITING_KB + FETCHING_KB, (alone_kb, beside_kb)
        assert _memory_kb(daemon, "VmRSS") - max(before_kb, left_kb) < WAITING_KB, (before_kb, left_kb)
    finally:
        daemon.stop()
