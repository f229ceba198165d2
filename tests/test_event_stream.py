"""The event stream of a running probe as a PC reads it: a press is told by its measurement, and none is missed."""

from __future__ import annotations

import json
from collections.abc import Iterator

import httpx
import pytest
from daemon_process import WAIT_S, Daemon, wait_for

pytestmark = [pytest.mark.real_time, pytest.mark.long]


def events(daemon: Daemon, last_id: str | None = None) -> Iterator[dict[str, str]]:
    """Yield events as their fields, as https://html.spec.whatwg.org/multipage/server-sent-events.html has them."""
    headers = {"Last-Event-ID": last_id} if last_id else {}
    with httpx.stream("GET", f"{daemon.url}/api/v1/events", headers=headers, timeout=WAIT_S) as answer:
        assert answer.headers["content-type"].startswith("text/event-stream")
        fields: dict[str, str] = {}
        for line in answer.iter_lines():
            if line:
                name, _, value = line.partition(": ")
                fields[name] = value
            else:
                yield fields
                fields = {}


def test_a_measurement_is_told_when_it_is_kept_and_to_who_comes_back(daemon):
    wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
    stream = events(daemon)
    first = next(stream)
    assert (first["event"], int(first["retry"])) == ("status", 1000)
    press = daemon.press("quick")
    told = next(event for event in stream if event["event"] == "measurement")
    stream.close()
    assert json.loads(told["data"]) == daemon.ask(f"/api/v1/measurements/{press['measurement_id']}").json
    exam = daemon.ask("/api/v1/exams", "POST", {"kind": "phantom", "operator": "Ada"}).json
    missed = events(daemon, told["id"])
    again = next(missed)
    assert (again["event"], again["id"]) == ("status", told["id"])
    since = next(event for event in missed if event["event"] != "status")
    missed.close()
    assert (since["event"], json.loads(since["data"])) == ("exam", exam)
    number, earlier = (int(event["id"].partition(":")[0]) for event in (since, told))
    assert number > earlier


def test_who_names_what_is_no_id_of_this_store_is_told_all_anew_as_after_a_restore(daemon):
    """A browser never comes back after another answer than a stream."""
    exam = daemon.ask("/api/v1/exams", "POST", {"kind": "phantom", "operator": "Ada"}).json
    for last_id in ("x", "1", "-1", "1" * 19, "1.0", f"1:{'0' * 64}"):
        stream = events(daemon, last_id)
        assert exam["id"] in (json.loads(event["data"])["id"] for event in stream if event["event"] == "exam")
        stream.close()
