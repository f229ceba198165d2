"""ENOSPC at every kind of step: what ran runs on, untouched, and nothing is left behind; the next attempt succeeds."""

import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from cut_disk import CutDisk, can_cut, run
from interrupted import Interrupted, ways_to_be_full
from updated_probe import IMPATIENT

from device.errors import UpdateFailed
from device.files import durable
from device.update import trial
from device.update.install import install
from device.update.progress import ProgressReport
from device.update.trial import Updater
from device.update.unpack import require_space


@pytest.mark.parametrize("how", ["full", "stays_full"])
def test_a_disk_that_becomes_full_at_a_step_leaves_what_ran_and_no_leftovers(probe, how):
    """Once the new release is committed it stays; nothing in between is seen. Both ways take turns with the steps."""
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    interrupted, file = Interrupted(probe), str(probe.write("1.2", 12))
    steps, ends = ways_to_be_full(interrupted.count("install", file)), set()
    for at in steps[::2] if how == "full" else steps[1::2]:
        interrupted.restore()
        probe.start()
        done = interrupted.run(how, at, "install", file)
        whole = probe.require_whole()
        assert whole == ("1.1+11" if done.returncode else "1.2+12"), (at, done.stderr)
        ends.add(whole)
        if done.returncode:
            assert done.stderr.startswith(("E012 ", "E013 1.2+12 was left: A step failed: ")), (at, done.stderr)
            assert probe.state.bad == {}, at
        if interrupted.is_as_before():
            continue
        if how == "full" and done.returncode:
            assert probe.progress.state in ("refused", "rolled_back"), at
            assert set(probe.releases()) == probe.state.keeps(), at
        probe.start_machine()
        assert probe.run("watch-incoming").returncode == 0, at
        assert set(probe.releases()) == probe.state.keeps(), at
        assert probe.state.pending is None, at
        assert probe.run("install", file).returncode == 0, (at, done.stderr)
        assert probe.require_whole() == "1.2+12", at
    assert ends == {"1.1+11", "1.2+12"}


def test_a_disk_without_space_is_told_before_anything_is_written(probe, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=64 * 2**20 + 20_000))
    path, before = probe.write("1.0", 10), probe.snapshot()
    with pytest.raises(UpdateFailed, match=r"has 67 MB free, and the release needs 67") as refusal:
        install(Updater(probe.layout, ProgressReport(probe.layout)), path)
    assert refusal.value.code == "E012"
    assert probe.progress.step == "space"
    assert probe.snapshot() == before


@pytest.mark.parametrize(("stated_mb", "needed_mb"), [(50, 84), (66, 100), (200, 234)])
def test_what_the_daemon_needs_to_be_ready_is_left_free_too(probe, monkeypatch, stated_mb, needed_mb):
    """Else unpacking would make the disk too full for a press, and every release would be taken back."""
    state(probe, f"[store]\nmin_free_mb = {stated_mb}\n")
    plan = SimpleNamespace(needed_bytes=lambda: 17_000_000)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=(needed_mb - 1) * 1e6))
    with pytest.raises(UpdateFailed, match=f"the release needs {needed_mb}, of which {needed_mb - 17} stay free"):
        require_space(probe.layout, plan)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=(needed_mb + 1) * 1e6))
    require_space(probe.layout, plan)


def test_what_the_daemon_needs_on_another_disk_is_not_asked_of_that_of_the_releases(probe, monkeypatch):
    (probe.root / "srv").symlink_to("/proc")  # what is surely another file system
    state(probe, "[store]\nmin_free_mb = 200\n", 'data = "/srv"\n')
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=85e6))
    require_space(probe.layout, SimpleNamespace(needed_bytes=lambda: 17_000_000))


def state(probe, below, above=""):
    settings = probe.root / "etc/tsis/config.toml"
    settings.write_text(f"{above}{settings.read_text()}{below}")


def test_a_release_whose_store_finds_the_disk_full_is_left_and_may_come_again(probe):
    probe.install("1.0", 10)
    done = probe.run(*IMPATIENT, "install", probe.write("1.1", 11, {"faults": {"store": "E602"}}))
    assert done.returncode == 1
    assert "store is not ready (E602)" in done.stderr
    assert "send the other one again" in done.stderr
    assert (probe.require_whole(), probe.releases()) == ("1.0+10", ["1.0+10"])
    assert probe.state.bad == {}
    assert (probe.progress.state, probe.state.history[-1].event) == ("rolled_back", "rolled_back")
    probe.install("1.1", 11)


@pytest.mark.parametrize(("free_bytes", "is_told"), [(2**19, True), (2**30, False)])
def test_a_release_on_a_disk_without_space_for_a_database_is_not_bad_for_that(probe, monkeypatch, free_bytes, is_told):
    """Its daemon does not even start, as the next one would not."""
    monkeypatch.setattr(os, "statvfs", lambda path: SimpleNamespace(f_bavail=free_bytes, f_frsize=1))
    assert trial._is_shut(probe.root / "var/lib/tsis") is is_told


@pytest.mark.skipif(not can_cut(), reason="needs root, loop devices and ext4")
def test_a_read_only_disk_is_told_from_a_folder_that_is_so_to_the_updater_alone(tmp_path):
    """`ProtectSystem=strict` of systemd/tsis-update.service makes a read-only mount of a data folder that takes all."""
    disk = CutDisk(tmp_path)
    try:
        run("mount", "--bind", "-o", "ro", str(disk.mount), str(disk.mount))
        assert os.statvfs(disk.mount).f_flag & os.ST_RDONLY
        assert not trial._is_shut(disk.mount)
        run("umount", str(disk.mount))
        run("mount", "-o", "remount,ro", str(disk.mount))
        assert trial._is_shut(disk.mount)
    finally:
        disk.down()


@pytest.mark.skipif(not can_cut(), reason="needs root, loop devices and ext4")
def test_a_disk_that_the_kernel_has_shut_for_errors_is_told_by_whichever_word_it_says(tmp_path):
    """Since Linux 6.12 ext4 does not set the flag of a read-only file system any more."""
    disk = CutDisk(tmp_path)
    try:
        run("mount", "-o", "remount,errors=remount-ro", str(disk.mount))
        [device] = [
            line.split()[0] for line in Path("/proc/mounts").read_text().splitlines() if str(disk.mount) in line
        ]
        trigger = Path("/sys/fs/ext4") / Path(device).name / "trigger_fs_error"
        if not os.access(trigger, os.W_OK):
            pytest.skip("this kernel does not let an error of ext4 be made")
        trigger.write_text("1")
        with pytest.raises(OSError, match="Read-only"):
            (disk.mount / "file").write_text("x")
        assert trial._is_shut(disk.mount)
    finally:
        disk.down()


def test_a_mount_whose_name_is_no_text_is_looked_past(tmp_path, monkeypatch):
    """As that of a stick with a label in Latin-1."""
    mounts = tmp_path / "mountinfo"
    mounts.write_bytes(b"1 0 8:1 / /media/M\xfcller rw - vfat /dev/sda1 ro\n\n2 0 7:7\n")
    monkeypatch.setattr(durable, "MOUNTS", mounts)
    assert not trial._is_shut(tmp_path)
    monkeypatch.setattr(durable, "MOUNTS", tmp_path / "none")
    assert not trial._is_shut(tmp_path)


@pytest.mark.parametrize("faults", [{"store": "E601"}, {"store": "E603"}, {"store": "E602", "answers": "E401"}])
def test_a_release_that_lacks_more_than_its_disk_is_bad(probe, faults):
    probe.install("1.0", 10)
    done = probe.run(*IMPATIENT, "install", probe.write("1.1", 11, {"faults": faults}))
    assert done.returncode == 1
    assert list(probe.state.bad) == ["1.1+11"]
