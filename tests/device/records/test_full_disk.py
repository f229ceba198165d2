"""A disk that is full says so and takes nothing by halves; with space again all goes on, without a restart."""

from contextlib import suppress

import pytest
from cut_disk import CutDisk, can_cut
from probe_card import add_measurement

from device.errors import DiskFullError
from device.records.store import Store


@pytest.mark.skipif(not can_cut(), reason="root, loop devices and ext4 are needed for a disk that can be filled")
def test_a_full_disk_is_told_reads_go_on_and_it_heals_by_itself(tmp_path):
    disk = CutDisk(tmp_path)
    try:
        store = Store(disk.mount / "var")
        kept = add_measurement(store, 1)
        store.require_space(20.0)
        fill(disk.mount / "fill")
        with pytest.raises(DiskFullError, match="0 MB left, below 20 MB"):
            store.require_space(20.0)
        with pytest.raises(DiskFullError) as refusal:
            add_many(store)
        assert refusal.value.code == "E602"
        held = store.measurements(before_seq=2**62, limit=1000)
        assert held[-1] == kept
        assert len(list((store.folder / "recordings").iterdir())) == len(held)
        (disk.mount / "fill").unlink()
        store.require_space(20.0)
        assert add_measurement(store, 1001)["seq"] > held[0]["seq"]
        store.close()
        again = Store(disk.mount / "var")
        assert again.findings.warnings() == ()
        again.close()
    finally:
        disk.down()


def add_many(store):
    """The log of the database may have room for some."""
    for number in range(2, 1000):
        add_measurement(store, number)


def fill(path):
    with path.open("wb", buffering=0) as file:
        for size_bytes in (1 << 20, 1 << 12, 1):
            with suppress(OSError):
                while True:
                    file.write(bytes(size_bytes))


def test_what_a_start_could_not_write_down_is_told_at_once_and_written_when_there_is_space(tmp_path, monkeypatch):
    first = Store(tmp_path)
    first.save_press({"id": "p-1", "state": "capturing", "mode": "quick"})
    first.close()

    def full(*_):
        raise DiskFullError("The disk is full.", "Free it.")

    with monkeypatch.context() as patched:
        patched.setattr(Store, "save_press", full)
        store = Store(tmp_path)
    assert store._records("SELECT record FROM press")[0]["state"] == "capturing"
    assert store.press("p-1")["state"] == store.last_press()["state"] == "failed"
    store.require_space(0.0)
    assert store._records("SELECT record FROM press")[0]["state"] == "failed"
    store.close()
