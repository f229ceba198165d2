"""A backup holds all that no release brings back, is whole or not there, and is told from a damaged one."""

from __future__ import annotations

import errno
import hashlib
import io
import json
import os
import sqlite3
import stat
import tarfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest
from probe_card import OWN_CARD, SERIAL, STICK, add_measurement, data_of, plug_in_stick, put, write_card

from device.care import backup as backup_module
from device.care.archive import Archive
from device.care.backup import BackupReport, write_backup
from device.care.restore import check_backup
from device.commands.backup import run
from device.errors import DiskFullError, StorageError
from device.files import medium
from device.files.plain_settings import layer_files
from device.files.recording_file import read_recording, write_recording
from device.measurement.quantities import InvalidQuantity
from device.records.database import DATABASE
from device.records.retention import RetentionRule
from device.records.saved import SAME_DISK, SAVED, same_disk_backups, saved_until
from device.records.schema import STORE_WRITES
from device.records.store import Store
from device.settings.layers import read_layers


@pytest.fixture(autouse=True)
def stick(monkeypatch: pytest.MonkeyPatch) -> None:
    plug_in_stick(monkeypatch)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    write_card(tmp_path / "card")
    return tmp_path / "card"


def saved(root: Path, file: Path, *, same_disk: bool = False) -> BackupReport:
    return write_backup(read_layers(layer_files(root)).config(), file, root, same_disk=same_disk)


def test_it_holds_records_settings_certificates_and_own_models(root: Path, tmp_path: Path) -> None:
    report = saved(root, tmp_path / "a.backup")
    assert (report.serial, report.measurements, report.missing) == (SERIAL, 3, ())
    with Archive(tmp_path / "a.backup") as archive:
        names = set(archive.entries)
        assert archive.manifest["store_schema"] == STORE_WRITES
    assert {f"data/recordings/r-{n}.zip" for n in (1, 2, 3)} < names
    assert {
        "data/tsis.sqlite",
        "data/config.last_good.toml",
        "data/calibrations/c-1.json",
        "data/calibrations/active",
        "settings/config.toml",
        "settings/config.d/50-press.toml",
        "models/quick_model/model.json",
    } < names
    assert not [name for name in names if name.endswith(("lock", "-wal", "-shm", ".tmp"))]


def test_nobody_but_its_owner_reads_it_and_nothing_is_left_beside_it(root: Path, tmp_path: Path) -> None:
    folder = tmp_path / "stick"
    folder.mkdir()
    saved(root, folder / "a.backup")
    assert [path.name for path in folder.iterdir()] == ["a.backup"]
    assert stat.S_IMODE((folder / "a.backup").stat().st_mode) == 0o600


def test_a_daemon_may_go_on_writing(root: Path, tmp_path: Path) -> None:
    """A store that is open has its newest rows in the file beside the database."""
    store = Store(data_of(root))
    try:
        add_measurement(store, 4)
        assert saved(root, tmp_path / "a.backup").measurements == 4
        add_measurement(store, 5)
    finally:
        store.close()
    assert check_backup(tmp_path / "a.backup")["measurements"] == 4


def refusing(number: int) -> Callable[[Path, bytes], None]:
    """Return what stands for a write that the kernel refuses."""

    def refused(path: Path, content: bytes) -> None:
        raise OSError(number, os.strerror(number))

    return refused


def test_a_card_that_is_mounted_to_be_read_only_is_saved_with_rows_that_were_not_closed(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = data_of(root)
    store = Store(data)
    add_measurement(store, 4)
    monkeypatch.setattr(os, "access", lambda path, mode: path != data)
    monkeypatch.setattr(backup_module, "write_durably", refusing(errno.EROFS))
    before = {path: path.stat().st_mtime_ns for path in data.iterdir()}
    assert saved(root, tmp_path / "a.backup").measurements == 4
    assert {path: path.stat().st_mtime_ns for path in data.iterdir()} == before
    store.close()


def test_a_recording_that_is_gone_is_named_and_a_link_is_not_followed(root: Path, tmp_path: Path) -> None:
    data = data_of(root)
    (data / "recordings/r-2.zip").unlink()
    (data / "recordings/elsewhere").symlink_to("/etc")
    report = saved(root, tmp_path / "a.backup")
    assert report.missing == ("r-2",)
    assert report.left_out == ("recordings/elsewhere",)
    with Archive(tmp_path / "a.backup") as archive:
        assert not [name for name in archive.entries if "elsewhere" in name]


def test_a_recording_that_an_earlier_release_kept_as_a_folder_is_saved_too(root: Path, tmp_path: Path) -> None:
    recordings = data_of(root) / "recordings"
    write_recording(read_recording(recordings / "r-2.zip"), recordings / "r-2")
    (recordings / "r-2.zip").unlink()
    assert saved(root, tmp_path / "a.backup").missing == ()
    with Archive(tmp_path / "a.backup") as archive:
        assert {f"data/recordings/r-2/{name}" for name in ("recording.json", "frames/000.png")} < set(archive.entries)


def test_a_file_that_is_there_is_not_written_over(root: Path, tmp_path: Path) -> None:
    put(tmp_path / "a.backup", "another")
    with pytest.raises(InvalidQuantity, match="a new file"):
        saved(root, tmp_path / "a.backup")
    assert (tmp_path / "a.backup").read_text() == "another"


def test_it_is_not_written_into_what_it_saves(root: Path) -> None:
    with pytest.raises(InvalidQuantity, match="outside of what it saves"):
        saved(root, data_of(root) / "a.backup")


@pytest.fixture
def no_stick(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was meant for a stick lands on the card: nobody has mounted one."""
    monkeypatch.setattr(medium, "device_number", lambda path: OWN_CARD)


@pytest.mark.usefixtures("no_stick")
def test_without_a_stick_nothing_is_written_to_the_card_and_nothing_counts_as_saved(root: Path, tmp_path: Path) -> None:
    (tmp_path / "media").mkdir()
    for file in (tmp_path / "media", tmp_path / "media/stick"):
        with pytest.raises(InvalidQuantity, match="on another medium than .*mount the stick first"):
            saved(root, file)
    assert list((tmp_path / "media").iterdir()) == []
    assert not {SAVED, SAME_DISK} & {path.name for path in data_of(root).iterdir()}


@pytest.mark.usefixtures("no_stick")
def test_a_backup_on_the_card_itself_lets_no_rule_delete_anything(
    root: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config, file = read_layers(layer_files(root)).config(), root / "home/a.backup"
    file.parent.mkdir()
    assert run(SimpleNamespace(file=file, root=root, same_disk=True, json=False), config) == 0
    assert "it does not count as saved" in capsys.readouterr().out.splitlines()[-2]
    assert check_backup(file)["measurements"] == 3
    assert same_disk_backups(data_of(root)) == ("/home/a.backup",)  # where it is once the card has started
    store = Store(data_of(root))
    plan = store.retention.carry_out(RetentionRule(free_mb=1e9))
    store.close()
    assert (plan.saved_at, plan.removals, plan.held_back) == (None, (), 3)


@pytest.mark.usefixtures("no_stick")
def test_a_backup_on_the_card_takes_nothing_from_one_on_a_stick(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as mounted:
        plug_in_stick(mounted)
        saved(root, tmp_path / "a.backup", same_disk=True)
    before = (data_of(root) / SAVED).read_bytes()
    assert saved(root, tmp_path / "b.backup", same_disk=True).is_same_disk
    assert (data_of(root) / SAVED).read_bytes() == before
    assert json.loads(before)["path"] == str(tmp_path / "a.backup")


def test_what_is_in_memory_is_gone_after_a_restart_and_refused(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mounts = put(tmp_path / "mountinfo", f"36 1 {STICK} / /tmp rw,nosuid - tmpfs tmpfs rw\n")
    monkeypatch.setattr(medium, "MOUNTS", mounts)
    with pytest.raises(InvalidQuantity, match="not in memory"):
        saved(root, tmp_path / "a.backup")


def test_a_note_of_an_earlier_release_still_says_what_its_backup_holds(root: Path, tmp_path: Path) -> None:
    saved(root, tmp_path / "a.backup")
    note = data_of(root) / SAVED
    note.write_text(json.dumps({name: said for name, said in json.loads(note.read_text()).items() if name != "path"}))
    with closing(sqlite3.connect(data_of(root) / DATABASE)) as db:
        found = saved_until(db, data_of(root))
    assert found is not None
    assert (found.newest_seq, found.path) == (3, "")


def test_a_data_folder_without_a_database_is_told(root: Path, tmp_path: Path) -> None:
    (data_of(root) / "tsis.sqlite").unlink()
    with pytest.raises(StorageError, match="no database in the data folder"):
        saved(root, tmp_path / "a.backup")


def test_a_damaged_database_gives_no_backup(root: Path, tmp_path: Path) -> None:
    database = data_of(root) / "tsis.sqlite"
    content = bytearray(database.read_bytes())
    content[4096:] = os.urandom(len(content) - 4096)
    database.write_bytes(content)
    with pytest.raises(StorageError, match="database"):
        saved(root, tmp_path / "a.backup")
    assert list(tmp_path.glob("*a.backup*")) == []


def test_a_medium_that_is_too_small_or_fails_is_left_as_it_was(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "stick"
    folder.mkdir()
    with monkeypatch.context() as small:
        small.setattr(backup_module.shutil, "disk_usage", lambda path: SimpleNamespace(free=1000))
        with pytest.raises(DiskFullError, match="has 0 MB left"):
            saved(root, folder / "a.backup")

    def failing(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(backup_module.ArchiveWriter, "close", failing)
        with pytest.raises(StorageError, match="No space left"):
            saved(root, folder / "a.backup")
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize(("number", "is_told"), [(errno.ENOSPC, True), (errno.EACCES, True), (errno.EROFS, False)])
def test_a_backup_that_retention_cannot_hear_of_says_so(
    root: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    number: int,
    *,
    is_told: bool,
) -> None:
    """On a full disk a rule that waits for a backup would wait for ever; a card that can only be read has no rule."""
    monkeypatch.setattr(backup_module, "write_durably", refusing(number))
    config = read_layers(layer_files(root)).config()
    assert run(SimpleNamespace(file=tmp_path / "a.backup", root=root, same_disk=False, json=False), config) == 0
    assert ("does not know of this one" in capsys.readouterr().out) is is_told
    assert saved(root, tmp_path / "b.backup").unnoted == (
        f"{data_of(root) / SAVED} cannot be written ({os.strerror(number)})" if is_told else ""
    )


@pytest.fixture
def whole(root: Path, tmp_path: Path) -> bytes:
    saved(root, tmp_path / "whole.backup")
    return (tmp_path / "whole.backup").read_bytes()


def check(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "other.backup").write_bytes(content)
    check_backup(tmp_path / "other.backup")


def test_one_byte_that_changed_anywhere_is_found(whole: bytes, tmp_path: Path) -> None:
    """Bytes between the members, which say nothing, excepted: tar fills its blocks up with zeros."""
    check(whole, tmp_path)
    with tarfile.open(fileobj=io.BytesIO(whole)) as tar:
        spans = [(one.offset_data, one.offset_data + one.size) for one in tar.getmembers()]
    for start, end in spans:
        for place in {start, (start + end) // 2, end - 1}:
            damaged = bytearray(whole)
            damaged[place] ^= 1
            with pytest.raises(InvalidQuantity, match="backup"):
                check(bytes(damaged), tmp_path)


def test_a_file_that_was_cut_short_is_found_wherever_it_ends(whole: bytes, tmp_path: Path) -> None:
    """What comes after the manifest is zeros only."""
    with tarfile.open(fileobj=io.BytesIO(whole)) as tar:
        manifest = tar.getmember("manifest.json")
    end = manifest.offset_data + manifest.size
    for length in (*range(0, end, 997), end - 1):
        with pytest.raises(InvalidQuantity, match="backup"):
            check(whole[:length], tmp_path)


def rewritten(whole: bytes, extra: tarfile.TarInfo, content: bytes = b"", *, in_manifest: bool = False) -> bytes:
    """Return the backup with one member more, before its manifest."""
    out = io.BytesIO()
    with tarfile.open(fileobj=io.BytesIO(whole)) as tar, tarfile.open(fileobj=out, mode="w") as new:
        for member in tar.getmembers():
            file = tar.extractfile(member)
            assert file is not None
            body = file.read()
            if member.name == "manifest.json":
                new.addfile(extra, io.BytesIO(content))
                if in_manifest:
                    manifest = json.loads(body)
                    digest = hashlib.sha256(content).hexdigest()
                    entry = {"name": extra.name, "size": len(content), "sha256": digest, "mode": extra.mode}
                    body = json.dumps({**manifest, "entries": [*manifest["entries"], entry]}).encode()
                    member.size = len(body)
            new.addfile(member, io.BytesIO(body))
    return out.getvalue()


@pytest.mark.parametrize("name", ["/etc/passwd", "data/../../x", "data", "other/x", "data/./x", "../x", "data//x"])
def test_a_member_that_leads_elsewhere_is_refused(whole: bytes, tmp_path: Path, name: str) -> None:
    with pytest.raises(InvalidQuantity, match="leads elsewhere"):
        check(rewritten(whole, tarfile.TarInfo(name), in_manifest=True), tmp_path)


@pytest.mark.parametrize("kind", [tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.CHRTYPE, tarfile.DIRTYPE, tarfile.FIFOTYPE])
def test_a_member_that_is_no_plain_file_is_refused(whole: bytes, tmp_path: Path, kind: bytes) -> None:
    member = tarfile.TarInfo("data/recordings/x")
    member.type, member.linkname = kind, "/etc/passwd"
    with pytest.raises(InvalidQuantity, match="of plain files"):
        check(rewritten(whole, member, in_manifest=True), tmp_path)


def test_a_file_that_the_manifest_does_not_name_is_refused(whole: bytes, tmp_path: Path) -> None:
    with pytest.raises(InvalidQuantity, match="no more and no less"):
        check(rewritten(whole, tarfile.TarInfo("data/recordings/x")), tmp_path)


def test_a_file_that_is_there_twice_is_refused(whole: bytes, tmp_path: Path) -> None:
    with pytest.raises(InvalidQuantity, match="there twice"):
        check(rewritten(whole, tarfile.TarInfo("data/calibrations/active")), tmp_path)


def test_another_tar_is_no_backup(tmp_path: Path) -> None:
    with tarfile.open(tmp_path / "other.tar", "w") as tar:
        tar.addfile(tarfile.TarInfo("data/x"))
    with pytest.raises(InvalidQuantity, match="manifest at the end is missing"):
        check_backup(tmp_path / "other.tar")
    with pytest.raises(InvalidQuantity, match="readable as a backup"):
        check_backup(tmp_path / "none")


def test_the_copied_database_is_one_file_of_one_moment(root: Path, tmp_path: Path) -> None:
    saved(root, tmp_path / "a.backup")
    with Archive(tmp_path / "a.backup") as archive:
        (tmp_path / "copy.sqlite").write_bytes(archive.read("data/tsis.sqlite"))
    db = sqlite3.connect(tmp_path / "copy.sqlite")
    assert db.execute("PRAGMA journal_mode").fetchone() == ("delete",)
    assert db.execute("SELECT count(*) FROM measurement").fetchone() == (3,)
    db.close()


def test_a_folder_gets_a_file_by_the_probes_name_and_retention_knows_what_it_holds(root: Path, tmp_path: Path) -> None:
    data = data_of(root)
    report = saved(root, tmp_path)
    assert Path(report.path).parent == tmp_path
    assert Path(report.path).name.startswith(f"{SERIAL}-20")
    store = Store(data)
    add_measurement(store, 4)
    plan = store.retention.plan(RetentionRule(free_mb=1e9))
    store.close()
    assert [one.recording_id for one in plan.removals] == ["r-1", "r-2", "r-3"]
    assert plan.held_back == 1


def test_a_recording_that_is_damaged_on_the_card_is_named_and_not_taken_for_saved(root: Path, tmp_path: Path) -> None:
    data = data_of(root)
    zipped = data / "recordings" / "r-2.zip"
    zipped.write_bytes(zipped.read_bytes()[:-1] + b"x")
    report = saved(root, tmp_path / "a.backup")
    assert (report.damaged, report.missing) == (("r-2",), ())
    with closing(sqlite3.connect(data / DATABASE)) as db:
        found = saved_until(db, data)
    assert found is not None
    assert (found.newest_seq, found.newest_id, found.left_out) == (3, "m-3", ("r-2",))


def test_a_recording_that_a_rule_has_deleted_is_not_missing_in_a_backup(root: Path, tmp_path: Path) -> None:
    data = data_of(root)
    saved(root, tmp_path / "a.backup")
    store = Store(data)
    assert len(store.retention.carry_out(RetentionRule(free_mb=1e9)).removals) == 3
    store.close()
    report = saved(root, tmp_path / "b.backup")
    assert (report.measurements, report.missing, report.damaged) == (3, (), ())
