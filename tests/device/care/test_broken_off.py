"""A backup that was killed leaves nothing that the next one does not take away, and nobody but its owner reads it."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import signal
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from daemon_process import ROOT
from probe_card import SERIAL, plug_in_stick, put, write_card

from device.__main__ import main
from device.care import broken_off
from device.care.backup import write_backup
from device.care.broken_off import leftovers
from device.errors import BusyError
from device.files.plain_settings import layer_files
from device.records.database import DATABASE
from device.settings.layers import read_layers

KILLED = """
import os, signal, sys
from device.__main__ import main
from device.care import archive
from device.files import medium

medium.device_number = lambda path: "no-disk:1" if "var/lib/tsis" in str(path) else "no-disk:2"
archive.ArchiveWriter.close = lambda self, facts: os.kill(os.getpid(), signal.SIGKILL)
main(["--root", sys.argv[1], "backup", sys.argv[2]])
"""


@pytest.fixture(autouse=True)
def stick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    plug_in_stick(monkeypatch)
    (tmp_path / "stick").mkdir()
    return tmp_path / "stick"


@pytest.fixture
def card(tmp_path: Path) -> Path:
    write_card(tmp_path / "card")
    return tmp_path / "card"


@pytest.fixture
def held(stick: Path) -> Iterator[None]:
    """Another backup is being written to the stick."""
    handle = os.open(stick, os.O_RDONLY)
    fcntl.flock(handle, fcntl.LOCK_EX)
    yield
    os.close(handle)


def killed(card: Path, target: Path) -> Path:
    """Kill a backup when all but its manifest is written; return the folder that it leaves."""
    command = [sys.executable, "-c", KILLED, str(card), str(target)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, umask=0o022, capture_output=True, check=False)
    assert done.returncode == -signal.SIGKILL, done.stderr
    [left] = (target if target.is_dir() else target.parent).iterdir()
    return left


@pytest.mark.parametrize("name", [".", "by-a-name-of-my-own.img"])
def test_what_a_killed_backup_leaves_is_private_and_the_next_one_takes_it_away(
    card: Path, stick: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    left = killed(card, stick / name)
    assert leftovers(stick, SERIAL) == [left]
    files = {path.name: stat.S_IMODE(path.stat().st_mode) for path in left.iterdir()}
    assert set(files.values()) == {0o600}
    assert DATABASE in files
    assert len(files) == 2  # and the backup that was half written
    assert main(["--root", str(card), "backup", str(stick)]) == 0
    assert capsys.readouterr().err.splitlines() == [f"removed: {left}, which a backup that was broken off had left"]
    [made] = stick.iterdir()
    assert made.suffix == ".backup"


def test_only_what_backups_of_this_probe_make_is_taken_for_their_leftovers(stick: Path) -> None:
    stamp = "20261122T100000Z.backup"
    own = (f".tsis-backup-{SERIAL}-ab12cd_9/x", ".tsis-backup-ab12cd_9/tsis.sqlite", f"{SERIAL}-{stamp}.tmp")
    others = (
        f"{SERIAL}-{stamp}",
        f"{SERIAL}-2-{stamp}.tmp",
        f"{SERIAL}-notes.backup.tmp",
        f".tsis-backup-{SERIAL}-2-ab12cd_9/x",
        ".tsis-backup-of-mine/x",
        f"deep/.tsis-backup-{SERIAL}-ab12cd_9/x",
    )
    for name in (*own, *others):
        put(stick / name, "x")
    (stick / ".tsis-backup-link4567").symlink_to(stick / "deep")
    assert {path.name for path in leftovers(stick, SERIAL)} == {name.split("/")[0] for name in own}


@pytest.mark.usefixtures("held")
def test_a_second_backup_to_the_same_folder_is_refused_and_takes_nothing_from_the_first(
    card: Path, stick: Path
) -> None:
    at_work = put(stick / f".tsis-backup-{SERIAL}-ab12cd_9/tsis.sqlite", "x")
    with pytest.raises(BusyError, match="Another backup is being written to"):
        write_backup(read_layers(layer_files(card)).config(), stick, card)
    assert list(stick.rglob("*")) == [at_work.parent, at_work]


def test_where_a_folder_cannot_be_held_a_backup_is_made_and_nothing_is_removed(
    card: Path, stick: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Over NFS another machine's backup may be under way there."""

    def refused(handle: int, how: int) -> None:
        raise OSError(errno.EBADF, os.strerror(errno.EBADF))

    at_work = put(stick / f".tsis-backup-{SERIAL}-ab12cd_9/tsis.sqlite", "x")
    monkeypatch.setattr(broken_off.fcntl, "flock", refused)
    assert write_backup(read_layers(layer_files(card)).config(), stick, card).measurements == 3
    assert at_work.exists()


def test_what_cannot_be_removed_is_said_and_stops_no_backup(
    card: Path, stick: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left, heard = put(stick / f".tsis-backup-{SERIAL}-ab12cd_9/tsis.sqlite", "x").parent, list[str]()
    rmtree = shutil.rmtree

    def refused(path: Path | str, **options: object) -> None:
        if path == left:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        rmtree(path, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(shutil, "rmtree", refused)
    write_backup(read_layers(layer_files(card)).config(), stick / "a.backup", card, told=heard.append)
    assert heard == [f"{left}, which a backup that was broken off has left, cannot be removed: Permission denied"]
    assert (stick / "a.backup").exists()
