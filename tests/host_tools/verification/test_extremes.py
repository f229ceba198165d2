"""The study of extremes sees a hang and a crash as what they are; the scenes themselves run in `verify --extremes`."""

import os
import time

from host_tools.verification import extremes


def _crash():
    os._exit(9)


def _hang():
    time.sleep(600)


def test_a_process_that_dies_is_a_failure():
    case = extremes._in_own_process("crash", _crash, "small")
    assert (case.outcome, case.message) == ("failure", "the process died")


def test_a_scene_that_hangs_is_a_failure(monkeypatch):
    monkeypatch.setattr(extremes, "TIME_LIMIT_S", 0.5)
    case = extremes._in_own_process("hang", _hang, "small")
    assert (case.outcome, case.message) == ("failure", "no answer after 0.5 s")


def test_an_extreme_scene_ends_in_a_result_or_a_refusal():
    by_name = {name: (build, strain) for name, build, strain in extremes.extreme_scenes()}
    assert extremes._in_own_process("small", *by_name["size 0.01 mm"]).outcome == "result"
    refused = extremes._in_own_process("wide", *by_name["Poisson ratio 0.5"])
    assert refused.outcome == "refused"
    assert "poisson_ratio" in refused.message
