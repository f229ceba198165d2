"""What a start of the machine makes of what it finds: a trial counted, left or carried on, leftovers gone."""

import json
from dataclasses import replace

import pytest

from device.update.layout import point
from device.update.progress import ProgressReport
from device.update.state import PendingRelease, read_state, write_state


@pytest.fixture
def on_trial(probe):
    """The power went while 1.1+11 was on trial; `behaviour` of it is decided by the test."""

    def begin(behaviour=None, **pending):
        probe.install("1.0", 10)
        probe.install("1.1", 11, behaviour)
        layout = probe.layout
        point(layout.updater, layout.release("1.0+10"))
        state = replace(read_state(layout), committed="1.0+10", previous=None, floor=10)
        write_state(layout, replace(state, pending=PendingRelease("1.1+11", **pending)))
        return probe

    return begin


def test_a_trial_that_the_power_interrupted_goes_on_after_the_start_and_is_committed(on_trial):
    probe = on_trial()
    assert probe.start_machine().stdout == "1.1+11 is on trial, start 1 of 3.\n"
    assert (probe.current, probe.state.pending.tries) == ("1.1+11", 1)
    assert probe.run("resume").returncode == 0
    assert (probe.state.committed, probe.state.pending, probe.state.floor) == ("1.1+11", None, 11)


def test_a_release_with_which_the_machine_starts_again_and_again_is_left_at_the_fourth_start(on_trial):
    probe = on_trial()
    for number in (1, 2, 3):
        assert f"start {number} of 3" in probe.start_machine().stdout
        assert probe.require_whole() == "1.1+11"
    assert "1.1+11 was left: The machine was started 3 times with it" in probe.start_machine().stdout
    assert probe.require_whole() == "1.0+10"
    assert probe.releases() == ["1.0+10"]
    assert "started 3 times" in probe.state.bad["1.1+11"]
    assert probe.state.history[-1].event == "rolled_back"
    assert (probe.progress.state, probe.progress.code) == ("rolled_back", "E013")
    assert probe.start_machine().stdout == "1.0+10 is committed.\n"


def test_a_start_before_the_link_was_exchanged_exchanges_it(on_trial):
    probe = on_trial()
    point(probe.layout.current, probe.layout.release("1.0+10"))
    probe.start_machine()
    assert probe.current == "1.1+11"
    assert probe.calls()[-2:] == ["daemon-reload", "start tsis.service"]


@pytest.mark.parametrize("was_back", [False, True])
def test_a_return_that_was_interrupted_ends_at_the_start_with_its_own_reason(on_trial, was_back):
    probe = on_trial(leaving="camera is not ready (E101)", is_bad=True)
    if was_back:
        point(probe.layout.current, probe.layout.release("1.0+10"))
    probe.start_machine()
    assert probe.require_whole() == "1.0+10"
    assert probe.state.bad == {"1.1+11": "camera is not ready (E101)"}
    assert probe.releases() == ["1.0+10"]


def test_a_trial_whose_release_is_not_there_ends_and_is_not_its_fault(on_trial):
    probe = on_trial()
    probe.layout.release("1.1+11").rename(probe.layout.releases / ".removed-1.1+11")
    point(probe.layout.current, probe.layout.release("1.0+10"))
    assert "Its folder is not there." in probe.start_machine().stdout
    assert (probe.require_whole(), probe.state.bad, probe.releases()) == ("1.0+10", {}, ["1.0+10"])


def test_a_trial_without_its_release_ends_also_while_the_machine_runs(on_trial):
    """As when a full disk let neither the state be written nor the folder stay."""
    probe = on_trial()
    point(probe.layout.current, probe.layout.release("1.0+10"))
    probe.layout.release("1.1+11").rename(probe.layout.releases / ".removed-1.1+11")
    done = probe.run("resume")
    assert done.stderr.startswith("E013 1.1+11 was left: Its folder is not there.")
    assert (probe.require_whole(), probe.state.pending, probe.state.bad) == ("1.0+10", None, {})


def test_who_follows_a_release_hears_the_end_though_the_updater_was_killed_meanwhile(on_trial):
    probe = on_trial()
    report = ProgressReport(probe.layout)
    report.release, report.file = "1.1+11", "7.7"
    report.tell("checking", 0.7, "health")
    probe.run("watch-incoming")
    assert (probe.progress.state, probe.progress.release, probe.progress.file) == ("committed", "1.1+11", "7.7")


def test_what_an_interrupted_installation_left_is_gone_and_the_progress_says_why(probe):
    probe.install("1.0", 10)
    for name in (".incoming-1.1+11", ".removed-0.9+9", "0.8+8"):
        (probe.layout.releases / name / "lib").mkdir(parents=True)
    probe.layout.taken.write_bytes(b"half")
    (probe.layout.incoming / ".upload-x").write_bytes(b"half")
    report = ProgressReport(probe.layout)
    report.release = "1.1+11"
    report.tell("unpacking", 0.3, "unpack")
    probe.start_machine()
    assert probe.releases() == ["1.0+10"]
    assert not probe.layout.taken.exists()
    assert list(probe.layout.incoming.iterdir()) == []
    assert (probe.progress.state, probe.progress.code, probe.progress.release) == ("refused", "E012", "1.1+11")
    assert "The power went" in probe.progress.reason


def test_what_waits_in_incoming_is_not_removed(probe):
    probe.install("1.0", 10)
    probe.layout.uploaded.write_bytes(b"waits")
    probe.start_machine()
    assert probe.layout.uploaded.exists()


def test_a_commit_whose_rest_was_interrupted_is_finished(probe, keys):
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    point(probe.layout.updater, probe.layout.release("1.0+10"))
    (probe.layout.releases / "0.9+9").mkdir()
    write_state(probe.layout, replace(read_state(probe.layout), is_finishing=True))
    probe.start_machine()
    assert probe.layout.linked(probe.layout.updater) == "1.1+11"
    assert probe.releases() == ["1.0+10", "1.1+11"]
    assert not probe.state.is_finishing


@pytest.mark.parametrize("content", [None, b"", b"{", b"[]", b'{"schema": "tsis.update_state/9"}', b"\xff\xfe"])
def test_without_its_state_the_probe_keeps_what_was_committed_and_its_counter(probe, content):
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    probe.layout.state.unlink()
    if content is not None:
        probe.layout.state.write_bytes(content)
    probe.start_machine()
    assert probe.require_whole() == "1.1+11"
    kept = json.loads(probe.layout.state.read_bytes())
    assert (kept["committed"], kept["floor"], kept["pending"]) == ("1.1+11", 11, None)
    assert probe.run("install", probe.write("1.0", 10)).returncode == 1


def test_a_link_that_somebody_turned_is_turned_back(probe):
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    point(probe.layout.current, probe.layout.release("1.0+10"))
    probe.start_machine()
    assert probe.current == "1.1+11"


def test_a_fresh_system_has_nothing_to_check(probe):
    done = probe.start_machine()
    assert (done.returncode, done.stdout) == (0, "No release is committed.\n")
    assert not probe.layout.state.exists()
