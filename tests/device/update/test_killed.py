"""SIGKILL after every kind of change to the disk: after it one whole release is current, and in the end the right one.

Killed while a release is installed, while one that is not healthy is left, and while an operator goes back; then the
machine starts, and the updater goes on. A start that finds all as it was before needs no second attempt here: that one
would be the first again. `make torture` kills at every change.
"""

import pytest
from interrupted import Interrupted, ways_to_be_killed


@pytest.fixture
def interrupted(probe):
    """A probe that has had two releases already, so that a third one also removes one."""
    probe.install("1.0", 10)
    probe.install("1.1", 11)
    return Interrupted(probe)


def kill_at(interrupted, words, wanted, again, places):
    """Kill at each place, start the machine, go on; `wanted` is the release that has to run in the end."""
    probe = interrupted.probe
    for at in places:
        interrupted.restore()
        done = interrupted.run("kill", at, *words)
        assert done.returncode == -9, (at, done.stdout, done.stderr)
        started = probe.start_machine()
        assert started.returncode == 0, (at, started.stderr)
        assert probe.require_whole() in ("1.0+10", "1.1+11", "1.2+12"), at
        if interrupted.is_as_before():
            continue
        resumed = probe.run("watch-incoming")
        assert resumed.returncode == 0, (at, resumed.stderr)
        assert probe.state.pending is None, at
        whole = probe.require_whole()
        assert whole == probe.state.committed == probe.layout.linked(probe.layout.updater), at
        assert set(probe.releases()) == probe.state.keeps(), at
        if whole != wanted:
            again(at)
        assert probe.require_whole() == wanted, at
        assert len(probe.releases()) <= 2, at


class TestKilled:
    def test_an_installation_killed_at_a_step_leaves_a_whole_release_and_in_the_end_the_new_one(self, interrupted):
        words = ("install", str(interrupted.probe.write("1.2", 12)))
        calls = interrupted.count(*words)
        assert interrupted.probe.current == "1.2+12"

        def again(at):
            raise AssertionError(f"{at}: neither as before nor {interrupted.probe.current} in the end")

        kill_at(interrupted, words, "1.2+12", again, ways_to_be_killed(calls))

    def test_a_return_from_a_bad_release_killed_at_a_step_ends_at_the_release_before(self, interrupted):
        """From where the trial is written down: before that it is any installation."""
        words = ("install", str(interrupted.probe.write("1.2", 12, {"dies_after": 1})))
        calls = interrupted.count(*words)
        assert interrupted.probe.current == "1.1+11"

        def again(at):
            raise AssertionError(f"{at}: {interrupted.probe.current} runs")

        first = interrupted.first_of_trial(calls)
        kill_at(interrupted, words, "1.1+11", again, ways_to_be_killed(calls, first))

    def test_a_way_back_killed_at_a_step_ends_at_one_of_both_and_can_be_asked_for_again(self, interrupted):
        calls = interrupted.count("roll-back")
        assert interrupted.probe.current == "1.0+10"

        def again(at):
            assert interrupted.probe.run("roll-back").returncode == 0, at

        kill_at(interrupted, ("roll-back",), "1.0+10", again, ways_to_be_killed(calls))
