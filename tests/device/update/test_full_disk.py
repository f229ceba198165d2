"""ENOSPC at every step: what ran runs on, untouched, and nothing is left behind; the next attempt succeeds."""

import shutil
from types import SimpleNamespace

import pytest
from daemon_process import ROOT
from interrupted import Interrupted

from device.errors import UpdateFailed
from device.update.install import install
from device.update.progress import ProgressReport
from device.update.trial import Updater

SAMPLED = 5


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.long)], ids=["sampled", "every"])
@pytest.mark.parametrize("how", ["full", "stays_full"])
def test_a_disk_that_becomes_full_at_a_step_leaves_what_ran_and_no_leftovers(probe, how, every):
    """Once the new release is committed it stays; nothing in between is seen. "Every" is every other step of each."""
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    interrupted, file = Interrupted(probe), str(probe.write("1.2", 12))
    steps, ends = len(interrupted.count("install", file)), set()
    each = range(1 if how == "full" else 2, steps + 1, 2)
    for at in each if every else {1 + k * (steps - 1) // (SAMPLED - 1) for k in range(SAMPLED)}:
        interrupted.restore()
        probe.run_code(str(ROOT / "tests" / "fake_systemd.py"), "start", "tsis.service")
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
    assert ends == {"1.1+11", "1.2+12"} or not every


def test_a_disk_without_space_is_told_before_anything_is_written(probe, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=64 * 2**20 + 20_000))
    path, before = probe.write("1.0", 10), probe.snapshot()
    with pytest.raises(UpdateFailed, match=r"has 67 MB free, and the release needs 67") as refusal:
        install(Updater(probe.layout, ProgressReport(probe.layout)), path)
    assert refusal.value.code == "E012"
    assert probe.progress.step == "space"
    assert probe.snapshot() == before
