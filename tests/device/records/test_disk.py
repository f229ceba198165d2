"""The board's own disk."""

import shutil

import pytest

from device.records.disk import LocalDisk


def test_what_is_written_is_there_and_what_is_left_is_what_the_system_says(tmp_path):
    with LocalDisk().file(tmp_path / "frame") as file:
        file.write(b"counts")
    assert (tmp_path / "frame").read_bytes() == b"counts"
    assert LocalDisk().free_bytes(tmp_path) == pytest.approx(shutil.disk_usage(tmp_path).free, rel=0.1)


def test_a_folder_that_is_gone_has_no_space_to_tell(tmp_path):
    with pytest.raises(FileNotFoundError):
        LocalDisk().free_bytes(tmp_path / "gone")
