"""ENOSPC at every step: what ran runs on, untouched, and nothing is left behind; the next attempt succeeds."""

import shutil
from types import SimpleNamespace

import pytest
from daemon_process import ROOT
from updated_probe import QUICK

KILLED = str(ROOT / "tests" / "killed_updater.py")
SAMPLED = 9


def refusing(probe, how, at, *words):
    return probe.run_code(KILLED, how, str(at), "--root", str(probe.root), *QUICK, *words)


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.long)], ids=["sampled", "every"])
@pytest.mark.parametrize("how", ["full", "stays_full"])
def test_a_disk_that_becomes_full_at_a_step_leaves_what_ran_and_no_leftovers(probe, how, every):
    """At the last steps the new release is committed already, and stays; nothing in between is seen."""
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    file = str(probe.write("1.2", 12))
    saved = probe.folder / "saved"
    shutil.copytree(probe.root, saved, symlinks=True)
    refusing(probe, "count", 0, "install", file)
    steps = int((probe.folder / "calls").read_text())
    ends = set()
    for at in range(1, steps + 1) if every else {1 + k * (steps - 1) // (SAMPLED - 1) for k in range(SAMPLED)}:
        probe.stop()
        shutil.rmtree(probe.root)
        shutil.copytree(saved, probe.root, symlinks=True)
        probe.run_code(str(ROOT / "tests" / "fake_systemd.py"), "systemctl", "start", "tsis.service")
        done = refusing(probe, how, at, "install", file)
        whole = probe.require_whole()
        assert whole == ("1.1+11" if done.returncode else "1.2+12"), (at, done.stderr)
        assert done.returncode == 0 or done.stderr.startswith(("E012 ", "E013 1.2+12 was left: A step failed: ")), at
        assert probe.state.bad == {}, at
        if how == "full":
            assert not [name for name in probe.releases() if name not in probe.state.keeps()], at
        probe.start_machine()
        assert probe.run("watch-incoming").returncode == 0, at
        assert not [name for name in probe.releases() if name not in probe.state.keeps()], at
        assert probe.state.pending is None, at
        assert probe.run("install", file).returncode == 0, (at, done.stderr)
        assert probe.require_whole() == "1.2+12", at
        ends.add(whole)
    assert ends == {"1.1+11", "1.2+12"} or not every


def test_a_disk_without_space_is_told_before_anything_is_written(probe, monkeypatch):
    from device.errors import UpdateFailed
    from device.update.install import install
    from device.update.progress import ProgressReport
    from device.update.trial import Updater

    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=64 * 2**20 + 20_000))
    path, before = probe.write("1.0", 10), probe.snapshot()
    with pytest.raises(UpdateFailed, match=r"has 67 MB free, and the release needs 67\.|MB free") as refusal:
        install(Updater(probe.layout, ProgressReport(probe.layout)), path)
    assert refusal.value.code == "E012"
    assert probe.progress.step == "space"
    assert probe.snapshot() == before
