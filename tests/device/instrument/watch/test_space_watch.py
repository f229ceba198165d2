"""A disk that is nearly full is warned of before the store refuses, and no longer once there is space again."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

import pytest
from cut_disk import CutDisk, can_cut

from device.config import Config, RetentionSection, StoreSection
from device.errors import ClockJumpError, DiskFullError
from device.instrument.watch.space_watch import SpaceWatch
from device.records.store import Store

OTHER = ClockJumpError("The clock was set by +3600.0 s.", "Check it.")


def leave(disk: CutDisk, store: Store, left_mb: float) -> None:
    """Fill the disk's file until so much is left, as recordings would."""
    path = disk.mount / "fill"
    path.unlink(missing_ok=True)
    with path.open("wb", buffering=0) as file:
        while store.free_mb > left_mb:
            file.write(bytes(1 << 20))


@pytest.mark.skipif(not can_cut(), reason="root, loop devices and ext4 are needed for a disk that can be filled")
def test_a_real_disk_that_fills_up_is_warned_of_then_refuses_and_is_well_again(tmp_path: Path) -> None:
    disk = CutDisk(tmp_path)
    try:
        with closing(Store(disk.mount / "var")) as store:
            settings = Config(store=StoreSection(min_free_mb=10.0, warn_free_mb=50.0))
            watch = SpaceWatch(store, settings)
            assert watch.warned([OTHER]) == (OTHER,)
            leave(disk, store, 45.5)
            other, low = watch.warned([OTHER])
            assert other is OTHER
            assert (low.code, low.severity, low.is_lasting) == ("E606", "warning", True)
            assert low.cause == f"The disk of {store.folder} has some 40 MB left, below 50 MB."
            assert watch.warned([OTHER, low]) == (OTHER, low)
            store.require_space(settings.store.min_free_mb)
            leave(disk, store, 9.0)
            assert watch.warned([low]) == ()
            with pytest.raises(DiskFullError):
                store.require_space(settings.store.min_free_mb)
            (disk.mount / "fill").unlink()
            assert watch.warned([OTHER, low]) == (OTHER,)
    finally:
        disk.down()


@pytest.mark.parametrize(
    ("store", "rule_mb", "warn_mb"),
    [
        (StoreSection(), None, 500.0),
        (StoreSection(min_free_mb=20.0), None, 200.0),
        (StoreSection(warn_free_mb=80.0), 2000.0, 80.0),
        (StoreSection(), 2000.0, 500.0),
        (StoreSection(), 150.0, 100.0),
        (StoreSection(), 50.0, 50.0),
    ],
)
def test_a_rule_that_makes_space_by_itself_comes_before_the_warning(
    store: StoreSection, rule_mb: float | None, warn_mb: float
) -> None:
    assert Config(store=store, retention=RetentionSection(free_mb=rule_mb)).warn_free_mb == warn_mb
