"""A file that one program writes and another one waits for."""

import os
from pathlib import Path

import pytest

from device.files.handed_over import HandedOverFile, is_held


def test_nothing_stands_under_the_name_until_all_of_it_is_there(tmp_path: Path):
    file = HandedOverFile(tmp_path)
    file.write(b"one ")
    file.write(b"two")
    assert not (tmp_path / "release").exists()
    assert file.bytes_written == 7
    there = file.hand_over("release")
    assert (tmp_path / "release").read_bytes() == b"one two"
    assert there.st_ino == (tmp_path / "release").stat().st_ino
    assert there.st_mode & 0o777 == 0o640
    assert os.listdir(tmp_path) == ["release"]
    assert not file.is_open


def test_what_waits_already_is_not_replaced(tmp_path: Path):
    (tmp_path / "release").write_bytes(b"first")
    file = HandedOverFile(tmp_path)
    file.write(b"second")
    with pytest.raises(FileExistsError):
        file.hand_over("release")
    assert (tmp_path / "release").read_bytes() == b"first"
    assert os.listdir(tmp_path) == ["release"]


def test_a_discarded_file_leaves_nothing(tmp_path: Path):
    file = HandedOverFile(tmp_path)
    file.write(b"half")
    file.discard()
    file.discard()
    assert os.listdir(tmp_path) == []


def test_a_file_is_held_while_somebody_writes_it(tmp_path: Path):
    file = HandedOverFile(tmp_path)
    (path,) = tmp_path.iterdir()
    assert is_held(path)
    file._file.close()  # as when its writer is killed
    assert not is_held(path)
    assert not is_held(tmp_path / "never")
