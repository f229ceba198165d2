"""Two partitions of a card are one medium, a stick is another one, and what is in memory is none."""

from __future__ import annotations

from pathlib import Path

import pytest

from device.files import medium
from device.files.medium import MEMORY, medium_of

MOUNTS = b"""24 1 179:2 / / rw,noatime shared:1 - ext4 /dev/mmcblk0p2 rw
25 24 179:1 / /boot/firmware rw - vfat /dev/mmcblk0p1 rw
26 24 0:31 / /tmp rw,nosuid,nodev shared:9 master:2 - tmpfs tmpfs rw
27 24 0:44 / /media/share rw - nfs4 server:/backups rw
28 24 8:1 / /media/stick rw - vfat /dev/sda1 rw
29 24 0:23 / /protected rw - overlay overlay rw
"""


@pytest.fixture(autouse=True)
def board(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kernel's files of a board with a card, a stick with a partition and one without."""
    blocks = tmp_path / "block"
    blocks.mkdir()
    for number, place in (("179:2", "mmcblk0/mmcblk0p2"), ("179:1", "mmcblk0/mmcblk0p1"), ("8:1", "sda/sda1")):
        (tmp_path / "devices" / place).mkdir(parents=True)
        (tmp_path / "devices" / place / "partition").write_text("1\n")
        (blocks / number).symlink_to(tmp_path / "devices" / place)
    (tmp_path / "devices/sdb").mkdir()
    (blocks / "8:16").symlink_to(tmp_path / "devices/sdb")
    (tmp_path / "mountinfo").write_bytes(MOUNTS)
    monkeypatch.setattr(medium, "BLOCKS", blocks)
    monkeypatch.setattr(medium, "MOUNTS", tmp_path / "mountinfo")
    monkeypatch.setattr(medium, "device_number", lambda folder: folder.name)


@pytest.mark.parametrize(
    ("number", "name"),
    [
        ("179:2", "mmcblk0"),
        ("179:1", "mmcblk0"),
        ("8:1", "sda"),
        ("8:16", "sdb"),
        ("0:31", MEMORY),
        ("0:23", MEMORY),
        ("0:44", "0:44"),
        ("99:9", "99:9"),
    ],
)
def test_a_medium_is_told_by_its_disk(number: str, name: str) -> None:
    assert medium_of(Path(number)) == name


def test_where_no_mounts_are_told_the_disk_still_is(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(medium, "MOUNTS", tmp_path / "none")
    assert medium_of(Path("179:2")) == "mmcblk0"
