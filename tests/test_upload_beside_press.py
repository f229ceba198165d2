"""A release of 120 MB arrives while a press is taken: the memory does not feel it, nor does the press."""

from __future__ import annotations

import http.client
import json
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from daemon_process import PATIENT, QUICK_HAND, Daemon, wait_for
from small_release import tar

pytestmark = [pytest.mark.real_time, pytest.mark.long]
SIZE_BYTES, PART_BYTES = 120_000_000, 64_000
MORE_KB = 30_000
"""Far below the file's size, above what a press takes besides."""
PARTS_A_LOOK = 50


def _peak_kb(daemon: Daemon) -> int:
    status = Path(f"/proc/{daemon.process.pid}/status").read_text()
    return int(status.partition("VmHWM:")[2].split()[0])


def _has_ended(daemon: Daemon, location: str) -> bool:
    return daemon.ask(location).json["state"] in ("done", "rejected", "failed")


def test_a_release_arrives_while_a_press_is_taken(tmp_path: Path):
    folder = tmp_path / "updates"
    (folder / "incoming").mkdir(parents=True)
    (folder / "progress.json").write_text(json.dumps({"state": "idle"}))
    daemon = Daemon(tmp_path, f'[settings]\nupdates = "{folder}"\n' + PATIENT + QUICK_HAND)
    assert daemon.press("quick")["state"] == "done"  # what a press takes is there
    Path(f"/proc/{daemon.process.pid}/clear_refs").write_text("5")  # proc(5): the peak counts anew
    before_kb = _peak_kb(daemon)
    beginning, presses = tar({"manifest.json": b'{"product": "tsis"}'}), list[str]()

    def parts() -> Iterator[bytes]:
        """The press begins when the file has begun; the file ends when the press has."""
        yield beginning
        wait_for(lambda: list((folder / "incoming").glob(".upload-*")), bool)
        presses.append(daemon.ask("/api/v1/presses", "POST", {"mode": "quick"}).headers["location"])
        left_bytes = SIZE_BYTES - len(beginning)
        number = 0
        while left_bytes:
            number += 1
            if number % PARTS_A_LOOK == 0 and left_bytes <= SIZE_BYTES // 2:
                wait_for(lambda: _has_ended(daemon, presses[0]), bool)
            elif number % PARTS_A_LOOK == 0:
                time.sleep(0.01)
            size_bytes = min(left_bytes, PART_BYTES)
            left_bytes -= size_bytes
            yield bytes(size_bytes)

    connection = http.client.HTTPConnection(urlsplit(daemon.url).netloc)
    headers = {"content-type": "application/octet-stream", "content-length": str(SIZE_BYTES)}
    connection.request("POST", "/api/v1/updates", body=parts(), headers=headers)
    answer = connection.getresponse()
    assert answer.status == 202, answer.read()
    connection.close()
    assert (folder / "incoming" / "update.release").stat().st_size == SIZE_BYTES
    assert daemon.ask(presses[0]).json["state"] == "done", daemon.ask(presses[0]).json
    assert _peak_kb(daemon) - before_kb < MORE_KB, (before_kb, _peak_kb(daemon))
    daemon.stop()
