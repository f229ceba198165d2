"""One self-test at a time; it ends in every case, and what it found stays readable."""

import threading

import pytest

from device.errors import BusyError, UnknownResource
from device.instrument.self_test.report import CheckResult
from device.instrument.self_test.requests import SelfTestRequests
from device.instrument.status import StatusBoard

GOOD, BAD = CheckResult("Light", "a", "passed"), CheckResult("Camera", "b", "failed")


class ScriptedTest:
    """A self-test whose checks end as written down; an exception is raised."""

    def __init__(self, board):
        self.board, self.script, self.seen = board, [[GOOD], [BAD]], []

    def results(self, job):
        for step in self.script:
            self.seen.append((self.board.now.step, job.on_block))
            if isinstance(step, Exception):
                raise step
            yield step


@pytest.fixture
def board():
    return StatusBoard()


@pytest.fixture
def script(board):
    return ScriptedTest(board)


@pytest.fixture
def requests(board, script):
    return SelfTestRequests(board, script, lambda: "2026-01-01T00:00:00Z", threading.Event())


def test_before_the_first_one_there_is_none_and_nothing_runs(requests, script):
    requests.run_if_asked()
    assert script.seen == []
    with pytest.raises(UnknownResource):
        _ = requests.last


def test_it_waits_runs_on_the_thread_that_is_given_and_keeps_its_results(requests, script, board):
    job = requests.ask(on_block=True, weight_n=None)
    assert (job.state, job.is_under_way) == ("waiting", True)
    requests.run_if_asked()
    assert script.seen == [("self_test", True)] * 2
    assert board.now.step == "starting"
    assert (requests.last.id, requests.last.state, requests.last.verdict) == (job.id, "done", "failed")
    assert requests.last.results == (GOOD, BAD)
    requests.run_if_asked()
    assert len(script.seen) == 2


def test_a_second_one_is_refused_until_the_first_has_ended(requests):
    requests.ask(on_block=False, weight_n=None)
    with pytest.raises(BusyError):
        requests.ask(on_block=False, weight_n=None)
    requests.run_if_asked()
    assert requests.ask(on_block=False, weight_n=2.0).weight_n == 2.0


def test_one_that_breaks_down_has_failed_even_if_all_before_had_passed(requests, script):
    script.script = [[GOOD], ZeroDivisionError("unforeseen")]
    requests.ask(on_block=False, weight_n=None)
    with pytest.raises(ZeroDivisionError):
        requests.run_if_asked()
    assert (requests.last.state, requests.last.verdict, requests.last.is_under_way) == ("failed", "failed", False)


def test_the_summary_tells_how_far_it_is(requests):
    requests.ask(on_block=False, weight_n=None)
    assert requests.last.summary() | {"id": ""} == {
        "id": "", "state": "waiting", "verdict": "not_tested", "checks": 0,
    }  # fmt: skip
    requests.run_if_asked()
    assert requests.last.summary()["checks"] == 2
    assert requests.last.as_record()["results"][1]["verdict"] == "failed"
