"""A probe that is saved while its daemon runs answers over REST from a new card as it did from the old one."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from daemon_process import QUICK_HAND, ROOT, Daemon

pytestmark = [pytest.mark.real_time, pytest.mark.long]  # three starts of a daemon


def device(folder: Path, *arguments: str) -> None:
    command = [sys.executable, "-m", "device", "--simulate", *arguments]
    done = subprocess.run(
        command, cwd=folder, env={"PYTHONPATH": str(ROOT)}, text=True, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr


def answers(daemon: Daemon) -> dict[str, object]:
    """Return everything that a client can ask of the measurements."""
    listed = daemon.ask("/api/v1/measurements").json
    found: dict[str, object] = {"listed": listed, "light": daemon.ask("/api/v1/device").json["light_on_s"]}
    for one in listed["measurements"]:
        for path in ("", "/features", "/image.png", "/recording.zip"):
            answer = daemon.ask(f"/api/v1/measurements/{one['id']}{path}")
            assert answer.status == 200
            found[one["id"] + path] = answer.body
    return found


def recordings(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("recordings/*.zip")}


def test_the_new_card_answers_as_the_old_one_did(tmp_path: Path) -> None:
    old, new = tmp_path / "old", tmp_path / "new"
    old.mkdir()
    new.mkdir()
    daemon = Daemon(old, QUICK_HAND)
    try:
        assert daemon.press("quick")["state"] == "done"
        device(old, "backup", "--same-disk", str(tmp_path / "a.backup"))
    finally:
        daemon.stop()
    device(new, "restore", str(tmp_path / "a.backup"))
    both = []
    for folder in (old, new):
        daemon = Daemon(folder, QUICK_HAND)
        try:
            both.append((answers(daemon), recordings(folder)))
        finally:
            daemon.stop()
    (before, kept), (after, brought) = both
    assert len(kept) == 1
    assert brought == kept
    assert before.pop("light") == pytest.approx(after.pop("light"), abs=15.0)  # some seconds behind, as at a power cut
    assert after == before
