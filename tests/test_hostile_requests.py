"""Bodies that no program should send: each is refused with what is wrong, and nothing of it is kept or begun."""

from __future__ import annotations

import json
import urllib.error
import urllib.request
from typing import Any

import pytest
from daemon_process import WAIT_S, Daemon, wait_for

pytestmark = [pytest.mark.real_time, pytest.mark.long]

EXAM = {"kind": "patient", "patient_ref": "A-17", "operator": "Ada", "clock_position": 3, "nipple_distance_mm": 3.5}
VALUES = [
    "NaN",
    "Infinity",
    "-Infinity",
    "1e999",
    "-1e999",
    "9223372036854775808",
    "1" * 5000,
    "true",
    '"1"',
    "[]",
    "{}",
]
TEXTS = ['"\\u0000"', '"\\ud800"', '"\\udfff x"', '"a\\u202eb"', '"' + "x" * 60_000 + '"', "7", "null"]


def bodies() -> dict[str, list[str]]:
    """Return by path what is sent there: a good body of it with one field that is none, or there twice."""
    scan = '{"mode": "precise", %s}'
    press, exam, test = '{"mode": "quick", %s}', json.dumps(EXAM)[:-1] + ", %s}", '{"on_block": false, %s}'
    return {
        "presses": [
            *(scan % f'"within_s": {value}' for value in VALUES),
            *(scan % f'"until": {{"size_mm": {value}}}' for value in VALUES),
            *(press % f'"exam_id": {text}' for text in TEXTS[:-1]),
            press % '"mode": "standard"', press % '"\\ud800": 1', '{"mode": "quick\\u0000"}', "[" * 50_000,
            "{",
        ],
        "exams": [
            *(exam % f'"clock_position_": {value}' for value in VALUES),
            *(json.dumps(EXAM | {"clock_position": None}).replace("null", value) for value in VALUES),
            *(json.dumps(EXAM | {"nipple_distance_mm": None}).replace("null", value) for value in VALUES),
            *(json.dumps(EXAM | {"patient_ref": None}).replace("null", text) for text in TEXTS),
            *(json.dumps(EXAM | {"operator": None}).replace("null", text) for text in TEXTS),
            exam % '"side": "left", "side": "right"',
        ],
        "self-test": [*(test % f'"weight_n": {value}' for value in VALUES), test % '"on_block": true'],
    }  # fmt: skip


def sent(daemon: Daemon, path: str, body: str) -> tuple[int, dict[str, Any]]:
    request = urllib.request.Request(
        f"{daemon.url}/api/v1/{path}", body.encode(), {"content-type": "application/json"}, method="POST"
    )
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(request, timeout=WAIT_S)
    with refused.value as answer:
        return answer.code, json.loads(answer.read())


def everything(daemon: Daemon) -> list[Any]:
    lists = ("presses", "measurements", "exams", "exams?kind=phantom", "audit?limit=200")
    return [daemon.ask(f"/api/v1/{path}").json for path in lists]


@pytest.mark.parametrize("path", ["presses", "exams", "self-test"])
def test_what_is_refused_leaves_everything_as_it_was(daemon, path):
    wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
    before = everything(daemon)
    for body in bodies()[path]:
        status, problem = sent(daemon, path, body)
        assert (status, problem["code"]) == (422, "E803"), body[:200]
        assert problem["detail"]
        assert problem["remedy"]
    assert everything(daemon) == before
    assert daemon.ask("/api/v1/status").json["press"] is None
    assert daemon.ask("/api/v1/self-test").status == 404
