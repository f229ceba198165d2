"""Files that are whole or not there."""

import stat

import pytest

from device.files import durable
from device.files.durable import write_durably, write_once


def test_a_file_is_written_with_its_folder_and_nothing_beside_it(tmp_path):
    write_durably(tmp_path / "new" / "a.json", b"content")
    assert (tmp_path / "new" / "a.json").read_bytes() == b"content"
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.json"]


def test_a_file_is_replaced_as_a_whole(tmp_path):
    write_durably(tmp_path / "a.json", b"a long first content")
    write_durably(tmp_path / "a.json", b"second")
    assert (tmp_path / "a.json").read_bytes() == b"second"


def test_when_the_disk_is_full_the_old_file_stays(tmp_path, monkeypatch):
    def full(path, content):
        path.write_bytes(content[:3])
        raise OSError(28, "No space left on device")

    write_durably(tmp_path / "a.json", b"first")
    monkeypatch.setattr(durable, "write_and_sync", full)
    with pytest.raises(OSError, match="No space left"):
        write_durably(tmp_path / "a.json", b"second")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"first"]


def test_a_file_that_is_written_once_is_read_only_and_alone(tmp_path):
    write_once(tmp_path / "new" / "a.json", b"content")
    [path] = (tmp_path / "new").iterdir()
    assert path.read_bytes() == b"content"
    assert stat.S_IMODE(path.stat().st_mode) == 0o444


def test_a_file_that_is_there_is_not_written_again(tmp_path):
    (tmp_path / "a.json").write_bytes(b"first")
    with pytest.raises(FileExistsError):
        write_once(tmp_path / "a.json", b"second")
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"first"]


def test_when_the_disk_is_full_nothing_is_left_of_what_was_to_be_written_once(tmp_path, monkeypatch):
    def full(path, content):
        path.write_bytes(content[:3])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(durable, "write_and_sync", full)
    with pytest.raises(OSError, match="No space left"):
        write_once(tmp_path / "a.json", b"second")
    assert list(tmp_path.iterdir()) == []
