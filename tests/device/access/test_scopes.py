"""Which token may what: every operation of the API by a table, and what is not in it needs more rather than less."""

import json

import pytest
from daemon_process import ROOT

from device.access.scopes import OPEN, SCOPES, may, need_of

DOCUMENT = json.loads((ROOT / "docs" / "openapi.json").read_text())
OPERATIONS = sorted((method.upper(), path) for path, found in DOCUMENT["paths"].items() for method in found)
MEASURED = ("presses", "exams", "measurements", "self-test", "tare", "worklist")


def expected(method, path):
    """The table of the threat model, written down a second time."""
    if (method, path) in {("GET", "/api/v1/health/live"), ("POST", "/api/v1/pairing/claim")}:
        return "nothing"
    if path in ("/api/v1/pairing", "/api/v1/screen"):
        return "own screen"
    if path.startswith("/api/v1/tokens"):
        return "admin"
    if path in ("/api/v1/worklist", "/api/v1/exams/{exam_id}/dicom.zip"):  # patients' names
        return "measure"
    if method == "GET":
        return "read"
    return "measure" if path.split("/")[3] in MEASURED else "admin"


@pytest.mark.parametrize(("method", "path"), OPERATIONS, ids=" ".join)
def test_every_operation_of_the_api_needs_what_the_table_says(method, path):
    assert need_of(method, path) == expected(method, path)


def test_nothing_but_whether_it_runs_the_code_and_whom_to_tell_is_open():
    pages = {("GET", "/pair"), ("GET", "/.well-known/security.txt")}
    assert {("GET", "/api/v1/health/live"), ("POST", "/api/v1/pairing/claim"), *pages} == OPEN
    assert need_of("GET", "/static/screen.js") == "nothing"
    assert need_of("POST", "/static/screen.js") == "admin"


@pytest.mark.parametrize(
    ("method", "path", "need"),
    [
        ("GET", "/", "read"),
        ("HEAD", "/api/v1/status", "read"),
        ("GET", "/metrics", "read"),
        ("GET", "/api/v1/none", "read"),
        ("POST", "/api/v1/none", "admin"),
        ("PUT", "/", "admin"),
        ("BREW", "/api/v1/status", "admin"),
        ("POST", "/api/v1/pressesandmore", "admin"),
        ("DELETE", "/api/v1/presses/x", "measure"),
        ("GET", "/api/v1/tokens", "admin"),
        ("GET", "/api/v1/pairing/", "read"),
        ("POST", "/api/v1/pairing/", "admin"),
        ("GET", "/staticky", "read"),
        ("GET", "/api/v1/exams/x/dicom.zip", "measure"),
        ("HEAD", "/api/v1/exams/x/dicom.zip", "measure"),
        ("GET", "/api/v1/exams/x/dicom", "read"),
    ],
)
def test_what_is_not_listed_needs_more_rather_than_less(method, path, need):
    assert need_of(method, path) == need


def test_a_scope_may_what_those_before_may_and_none_what_needs_the_own_screen():
    allowed = {scope: [need for need in ("nothing", *SCOPES, "own screen") if may(scope, need)] for scope in SCOPES}
    assert allowed == {
        "read": ["nothing", "read"],
        "measure": ["nothing", "read", "measure"],
        "admin": ["nothing", "read", "measure", "admin"],
    }
