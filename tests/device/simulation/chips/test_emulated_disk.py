"""A disk that is full for a while, as the kernel says itself, or that cannot be written."""

import errno

import pytest

from device.simulation import faults
from device.simulation.chips.emulated_storage import LOW_BYTES, EmulatedDisk
from device.simulation.faults import FaultTimeline, ScriptedFault


def write(disk, path):
    with disk.file(path) as file:
        file.write(b"counts")


def test_a_full_disk_takes_nothing_and_has_nothing_left_until_there_is_space_again(tmp_path):
    now_s = [0.0]
    disk = EmulatedDisk(FaultTimeline([ScriptedFault("disk_full", until_s=1.0)], clock=lambda: now_s[0]))
    assert disk.free_bytes(tmp_path) == 0
    with pytest.raises(OSError, match="No space left") as full:
        write(disk, tmp_path / "frame")
    assert full.value.errno == errno.ENOSPC
    assert list(tmp_path.iterdir()) == []
    now_s[0] = 1.0
    write(disk, tmp_path / "frame")
    assert (tmp_path / "frame").read_bytes() == b"counts"
    assert disk.free_bytes(tmp_path) > 0


def test_a_low_disk_takes_what_comes_and_says_how_little_is_left(tmp_path):
    now_s = [0.0]
    disk = EmulatedDisk(FaultTimeline([ScriptedFault("disk_low", until_s=1.0)], clock=lambda: now_s[0]))
    assert disk.free_bytes(tmp_path) == LOW_BYTES
    write(disk, tmp_path / "frame")
    now_s[0] = 1.0
    assert disk.free_bytes(tmp_path) > LOW_BYTES


def test_a_read_only_disk_takes_nothing_and_still_has_space(tmp_path):
    disk = EmulatedDisk(FaultTimeline([ScriptedFault("disk_read_only")]))
    with pytest.raises(OSError, match="Read-only file system") as refused:
        write(disk, tmp_path / "frame")
    assert refused.value.errno == errno.EROFS
    assert list(tmp_path.iterdir()) == []
    assert disk.free_bytes(tmp_path) > 0


@pytest.mark.parametrize("call", ["write", "free_bytes"])
def test_a_frozen_disk_answers_when_it_thaws_and_not_before(call, tmp_path, monkeypatch):
    now_s, waits = [0.0], []

    def wait(seconds):
        waits.append(list(tmp_path.iterdir()))
        now_s[0] += 1.0

    monkeypatch.setattr(faults.time, "sleep", wait)
    disk = EmulatedDisk(FaultTimeline([ScriptedFault("disk_frozen", until_s=3.0)], clock=lambda: now_s[0]))
    if call == "write":
        write(disk, tmp_path / "frame")
        assert (tmp_path / "frame").read_bytes() == b"counts"
    else:
        assert disk.free_bytes(tmp_path) > 0
    assert waits == [[], [], []]
