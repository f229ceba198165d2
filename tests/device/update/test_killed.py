"""SIGKILL at every change to the disk: after it one whole release is current, and in the end the right one.

Killed while a release is installed, while one that is not healthy is left, and while an operator goes back; then the
machine starts, and the updater goes on.
"""

import shutil
from pathlib import Path

import pytest
from daemon_process import ROOT
from updated_probe import QUICK

KILLED = str(ROOT / "tests" / "killed_updater.py")
SAMPLED = 9


@pytest.fixture
def two_releases(probe):
    """A probe that has had two releases already, so that a third one also removes one."""
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    return probe


def killed(probe, at, *words):
    options = ("--root", str(probe.root), *QUICK)
    return probe.run_code(KILLED, "kill" if at else "count", str(at), *options, *words)


def steps_of(probe, *words):
    """Return how many changes to the disk there are when nothing interrupts."""
    killed(probe, 0, *words)
    return int((probe.folder / "calls").read_text())


def copy_of(probe, folder):
    """Return the state of the probe's root, to begin each story at the same point."""
    shutil.copytree(probe.root, folder, symlinks=True)
    return folder


def restore(probe, saved):
    probe.stop()
    shutil.rmtree(probe.root)
    shutil.copytree(saved, probe.root, symlinks=True)


def stories(probe, words, wanted, again, every):
    """Kill at each step, start the machine, go on; `wanted` is the release that has to run in the end."""
    saved = copy_of(probe, probe.folder / "saved")
    steps = steps_of(probe, *words)
    assert probe.current == wanted
    chosen = range(1, steps + 1) if every else sorted({1 + k * (steps - 1) // (SAMPLED - 1) for k in range(SAMPLED)})
    for at in chosen:
        restore(probe, saved)
        done = killed(probe, at, *words)
        assert done.returncode == -9, (at, done.stdout, done.stderr)
        started = probe.start_machine()
        assert started.returncode == 0, (at, started.stderr)
        assert probe.require_whole() in ("1.0+10", "1.1+11", "1.2+12"), at
        resumed = probe.run("watch-incoming")
        assert resumed.returncode == 0, (at, resumed.stderr)
        assert probe.state.pending is None, at
        whole = probe.require_whole()
        assert whole == probe.state.committed == probe.layout.linked(probe.layout.updater), at
        assert not [name for name in probe.releases() if name.startswith(".")], at
        if whole != wanted:
            again(at)
        assert probe.require_whole() == wanted, at
        assert len(probe.releases()) <= 2, at
    return steps


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.long)], ids=["sampled", "every"])
class TestKilled:
    def test_an_installation_killed_at_a_step_leaves_a_whole_release_and_in_the_end_the_new_one(
        self, two_releases, every
    ):
        probe = two_releases
        file: Path = probe.write("1.2", 12)

        def again(at):
            done = probe.run("install", file)
            assert done.returncode == 0, (at, done.stderr)

        assert stories(probe, ("install", str(file)), "1.2+12", again, every) > 40

    def test_a_return_from_a_bad_release_killed_at_a_step_ends_at_the_release_before(self, two_releases, every):
        probe = two_releases
        file = probe.write("1.2", 12, {"dies_after": 1})

        def again(at):
            raise AssertionError(f"{at}: {probe.current} runs")

        assert stories(probe, ("install", str(file)), "1.1+11", again, every) > 40

    def test_a_way_back_killed_at_a_step_ends_at_one_of_both_and_can_be_asked_for_again(self, two_releases, every):
        probe = two_releases

        def again(at):
            assert probe.run("roll-back").returncode == 0, at

        assert stories(probe, ("roll-back",), "1.0+10", again, every) > 8
