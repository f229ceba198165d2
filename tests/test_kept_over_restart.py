"""What a daemon that is killed, or whose database is damaged, tells over REST once it has been started again."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from daemon_process import QUICK_HAND, Daemon, wait_for

pytestmark = [pytest.mark.real_time, pytest.mark.long]


def killed(daemon: Daemon) -> None:
    daemon.process.kill()
    daemon.ended_code()


def codes(daemon: Daemon) -> list[str]:
    return [fault["code"] for fault in daemon.ask("/api/v1/status").json["faults"]]


def test_a_press_that_a_kill_broke_off_and_the_last_result_are_told_after_it(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path, QUICK_HAND)
    done = daemon.press("quick")
    assert done["state"] == "done"
    killed(daemon)

    daemon = Daemon(tmp_path, QUICK_HAND)
    status = daemon.ask("/api/v1/status").json
    assert (status["press"]["id"], status["press"]["state"]) == (done["id"], "done")
    assert status["measurement_id"] == done["measurement_id"]
    assert "E904" not in codes(daemon)
    location = daemon.ask("/api/v1/presses", "POST", {"mode": "quick"}).headers["location"]
    wait_for(lambda: daemon.ask(location).json["state"], lambda state: state == "capturing")
    killed(daemon)

    daemon = Daemon(tmp_path, QUICK_HAND)
    try:
        status = daemon.ask("/api/v1/status").json
        assert location.endswith(status["press"]["id"])
        assert (status["press"]["state"], status["press"]["code"]) == ("failed", "E904")
        assert "restarted during the press" in status["press"]["reason"]
        assert "E904" in codes(daemon)
        assert daemon.ask(location).json == status["press"]
        assert daemon.ask(f"/api/v1/measurements/{done['measurement_id']}/recording.zip").status == 200
        assert daemon.press("quick")["state"] == "done"
        assert "E904" in [warning["code"] for warning in daemon.ask("/api/v1/status").json["press"]["warnings"]]
        assert daemon.press("quick")["state"] == "done"
        assert "E904" not in codes(daemon)
    finally:
        daemon.stop()


def test_a_damaged_database_starts_at_fault_and_shows_what_can_be_read(tmp_path: Path) -> None:
    daemon = Daemon(tmp_path, QUICK_HAND)
    done = daemon.press("quick")
    daemon.stop()
    database = tmp_path / "var" / "tsis.sqlite"
    with database.open("r+b") as file:  # a page of an index: rows are found without it
        size = file.seek(0, os.SEEK_END)
        page = next(at for at in range(4096, size, 4096) if _is_index_leaf(database, at))
        file.seek(page)
        file.write(os.urandom(4096))
    before = database.read_bytes()
    daemon = Daemon(tmp_path, QUICK_HAND)
    try:
        wait_for(lambda: codes(daemon), lambda shown: "E603" in shown)
        ready = daemon.ask("/api/v1/health/ready")
        assert (ready.status, ready.json["code"]) == (500, "E603")
        refused = daemon.ask("/api/v1/presses", "POST", {})
        assert (refused.status, refused.json["code"]) == (500, "E603")
        assert "restore" in refused.json["remedy"]
        [shown] = daemon.ask("/api/v1/measurements").json["measurements"]
        assert shown["id"] == done["measurement_id"]
        assert daemon.ask(f"/api/v1/measurements/{shown['id']}/recording.zip").status == 200
        assert daemon.ask("/api/v1/health/parts").json["parts"]["store"] == {"ready": False, "code": "E603"}
    finally:
        assert daemon.stop() == 0
    assert database.read_bytes() == before


def _is_index_leaf(database: Path, at: int) -> bool:
    return database.read_bytes()[at] == 10  # https://www.sqlite.org/fileformat2.html#b_tree_pages
