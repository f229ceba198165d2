"""Numbers that are none, text that is none, and ids of nobody: refused alike, and the store stays as it was."""

import asyncio
import json
import re
import types
from pathlib import Path

import httpx
import pytest

from device.web.app import create_app

PATIENT = '"kind": "patient", "patient_ref": "A-17", "operator": "Ada"'
NUMBERS = [
    "NaN",
    "Infinity",
    "-Infinity",
    "1e999",
    "-1e999",
    "9223372036854775808",
    "-0.001",
    "true",
    '"1"',
    "[1]",
    "{}",
]
BODIES = {
    **{f"a number that is {number}": f'{{{PATIENT}, "nipple_distance_mm": {number}}}' for number in NUMBERS},
    **{
        f"a whole number that is {one}": f'{{{PATIENT}, "clock_position": {one}}}'
        for one in ("2.5", "13", "true", "1e3")
    },
    "a key twice": f'{{{PATIENT}, "operator": "Bo"}}',
    "a NUL": '{"kind": "phantom", "operator": "A\\u0000da"}',
    "a NUL as it is": '{"kind": "phantom", "operator": "A\x00da"}',
    "a lone surrogate": '{"kind": "phantom", "operator": "A\\ud800da"}',
    "a line more": '{"kind": "phantom", "operator": "A\\nda"}',
    "an unknown field": '{"kind": "phantom", "operator": "Ada", "diagnosis": "x"}',
    "nesting": f'{{"kind": "phantom", "operator": "Ada", "note": {"[" * 30_000}{"]" * 30_000}}}',
    "half": '{"kind": "phantom", "operator": "Ada"',
    "nothing": "",
    "no text": b"\xff\xfe\x00",
}
IDS = ["00000000-0000-4000-8000-000000000000", "1", "..%2f..%2fetc%2fpasswd", "%00", "' OR '1'='1", "x" * 300]


@pytest.fixture
def ask(store):
    app = create_app(types.SimpleNamespace(), store)

    def asking(method, path, content=None):
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                headers = {"content-type": "application/json"}
                return await client.request(method, f"/api/v1/{path}", headers=headers, content=content)

        return asyncio.run(answer())

    return asking


def everything(store):
    return list(store._db.iterdump())


@pytest.mark.parametrize("what", BODIES)
def test_what_is_no_exam_is_refused_and_changes_nothing(ask, store, what):
    before = everything(store)
    answer = ask("POST", "exams", BODIES[what])
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert everything(store) == before
    assert ask("GET", "exams").status_code == 200


@pytest.mark.parametrize("path", ["exams/{}", "measurements/{}", "measurements/{}/image.png", "presses/{}"])
def test_whatever_is_not_there_is_not_there_in_the_same_words(ask, path):
    answers = [ask("GET", path.format(identifier)) for identifier in IDS]
    assert {answer.status_code for answer in answers} == {404}
    assert {answer.json()["title"] for answer in answers} == {"Not Found"}


@pytest.mark.parametrize("query", ["limit=0", "limit=201", "limit=9223372036854775808", "limit=NaN", "limit=1.5"])
def test_a_bound_that_is_none_is_refused(ask, query):
    assert ask("GET", f"exams?{query}").status_code == 422


def test_no_operation_is_reached_by_its_path_and_a_line_feed(ask, store):
    """Routes match a path with `$`, which a line feed at the end passes; what a token may is told by the letter."""
    document = json.loads(Path("docs/openapi.json").read_text(encoding="utf-8"))
    operations = [(method, path) for path, methods in document["paths"].items() for method in methods]
    assert ("get", "/api/v1/pairing") in operations
    before = everything(store)
    for method, path in operations:
        plain = re.sub(r"{\w+}", "1", path.removeprefix("/api/v1/"))
        answer = ask(method.upper(), f"{plain}%0A", "{}")
        assert (answer.status_code, answer.json()["code"]) == (404, "E804"), path
    assert everything(store) == before
