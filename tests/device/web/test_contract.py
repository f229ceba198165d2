"""The OpenAPI document is committed, names every operation, and says of every answer what it is."""

import json
import re
import types

import pytest
from daemon_process import ROOT

from device.web.app import create_app
from device.web.contract import TAGS

DOCUMENT = json.loads((ROOT / "docs" / "openapi.json").read_text(encoding="utf-8"))
OPERATIONS = {
    f"{method.upper()} {path.removeprefix('/api/v1/')}": operation
    for path, methods in DOCUMENT["paths"].items()
    for method, operation in methods.items()
}
PICTURE, RECORDING = "GET measurements/{measurement_id}/image.png", "GET measurements/{measurement_id}/recording.zip"


def good(operation):
    """Return status, media types with their schemas, and headers of the good answer."""
    [(status, answer)] = (
        (status, answer) for status, answer in operation["responses"].items() if status not in ("304", "default")
    )
    return int(status), {name: one["schema"] for name, one in answer["content"].items()}, answer.get("headers", {})


def test_the_committed_document_is_the_api():
    """`make check` compares it, too. Meant to change? `python -m device openapi > docs/openapi.json`."""
    assert create_app(types.SimpleNamespace(), types.SimpleNamespace()).openapi() == DOCUMENT


def test_every_operation_has_a_name_of_its_own_and_a_known_tag():
    names = [operation["operationId"] for operation in OPERATIONS.values()]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[a-z]+(_[a-z]+)+", name) for name in names)
    assert {tag for operation in OPERATIONS.values() for tag in operation["tags"]} == {tag["name"] for tag in TAGS}


@pytest.mark.parametrize("name", sorted(OPERATIONS))
def test_an_answer_is_a_named_model_or_says_its_media_type_and_may_be_a_problem(name):
    _, media, _ = good(OPERATIONS[name])
    [(media_type, schema)] = media.items()
    if media_type == "application/json":
        assert list(schema) == ["$ref"]
    else:
        assert schema["type"] == "string"
    assert OPERATIONS[name]["responses"]["default"] == {"$ref": "#/components/responses/Problem"}


def test_what_is_no_json_says_what_it_is():
    binary = {"type": "string", "format": "binary"}
    assert good(OPERATIONS[PICTURE])[1] == {"image/png": binary}
    assert good(OPERATIONS[RECORDING])[1] == {"application/zip": binary}
    assert good(OPERATIONS["GET events"])[1] == {"text/event-stream": {"type": "string"}}
    upload = OPERATIONS["POST updates"]["requestBody"]["content"]
    assert upload == {"application/octet-stream": {"schema": binary}}


def test_the_one_problem_is_a_problem_document():
    content = DOCUMENT["components"]["responses"]["Problem"]["content"]
    assert content == {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}


def test_who_starts_something_is_told_where_to_follow_it():
    asked = ("POST presses", "POST self-test", "POST updates", "POST updates/roll-back")
    made = ("POST exams", "POST exams/{exam_id}/another-place", "POST worklist/exams")
    assert {name for name in OPERATIONS if "Location" in good(OPERATIONS[name])[2]} == {*asked, *made}


def test_what_changes_something_wants_the_version_that_was_seen_and_what_starts_something_may_have_a_key():
    headers = {
        name: {
            one["name"]: one["required"]
            for one in operation.get("parameters", ())
            if one["in"] == "header" and one["name"] not in ("If-None-Match", "Last-Event-ID")
        }
        for name, operation in OPERATIONS.items()
    }
    acts = ("PATCH exams/{exam_id}", *(f"POST measurements/{{measurement_id}}/{act}" for act in ("move", "void")))
    assert {name: wanted for name, wanted in headers.items() if wanted} == {
        "POST presses": {"Idempotency-Key": False, "If-Match": False},
        "POST exams": {"Idempotency-Key": False},
        "POST worklist/exams": {"Idempotency-Key": False},
        "POST exams/{exam_id}/another-place": {"If-Match": True, "Idempotency-Key": False},
        "POST exams/{exam_id}/dicom": {"If-Match": True},
        **{act: {"If-Match": True, "Idempotency-Key": False} for act in acts},
    }
    for name in (*acts, "GET exams/{exam_id}", "GET measurements/{measurement_id}", "POST exams"):
        assert "ETag" in good(OPERATIONS[name])[2]


def test_what_has_a_tag_is_not_sent_again_to_who_has_it():
    tagged = [name for name in OPERATIONS if name.startswith("GET") and "ETag" in good(OPERATIONS[name])[2]]
    asking = [
        name
        for name, operation in OPERATIONS.items()
        if "If-None-Match" in [one["name"] for one in operation.get("parameters", ())]
    ]
    assert asking == tagged == [name for name, operation in OPERATIONS.items() if "304" in operation["responses"]]
    lists = {f"GET {name}" for name in ("measurements", "presses", "exams", "audit")}
    assert {*lists, PICTURE, RECORDING, "GET exams/{exam_id}", "GET measurements/{measurement_id}"} <= set(tagged)


def test_a_change_of_an_exam_says_no_default_for_what_is_not_named():
    """A generated client sends the defaults: the note of a patient was emptied by each change of something else."""
    fields = DOCUMENT["components"]["schemas"]["ExamFields"]["properties"]
    assert [name for name, field in fields.items() if "default" in field] == []
    assert (fields["operator"]["type"], fields["kind"]["type"]) == ("string", "string")
    assert {"type": "null"} in fields["patient_ref"]["anyOf"]


def test_how_sure_a_scan_is_to_be_is_typed_and_bounded():
    asked = DOCUMENT["components"]["schemas"]["PressRequest"]["properties"]
    until, within = (asked[name]["anyOf"] for name in ("until", "within_s"))
    assert until[0]["additionalProperties"] is False
    assert until[0]["properties"]["depth_mm"] == {"type": "number", "exclusiveMinimum": 0.0, "maximum": 20.0}
    assert within == [{"type": "number", "minimum": 5.0, "maximum": 300.0}, {"type": "null"}]


def test_a_body_is_what_is_sent_where_one_is_and_no_union_with_null():
    bodies = [one["requestBody"] for one in OPERATIONS.values() if "requestBody" in one]
    assert not [one for body in bodies for one in body["content"].values() if "anyOf" in one["schema"]]


def test_it_says_how_other_machines_prove_who_they_are():
    assert DOCUMENT["components"]["securitySchemes"]["bearer"]["scheme"] == "bearer"
    assert DOCUMENT["security"] == [{"bearer": []}, {}]
    open_to_all = {name for name, operation in OPERATIONS.items() if operation.get("security") == [{}]}
    assert open_to_all == {"GET health/live", "POST pairing/claim"}


def test_an_enumeration_that_may_grow_breaks_no_client():
    schemas = DOCUMENT["components"]["schemas"]
    growing = [schemas["FaultCode"], schemas["PressStateCode"], schemas["Status"]["properties"]["step"]]
    for one in (*growing, schemas["AuditEntry"]["properties"]["what"]):
        assert one["type"] == "string"
        assert "enum" not in one
        assert len(one["x-extensible-enum"]) > 5


def test_a_moment_is_said_to_be_one():
    """The hospital's worklist says its times in a form of DICOM's."""
    schemas = DOCUMENT["components"]["schemas"]
    plain = {
        f"{name}.{field}"
        for name, schema in schemas.items()
        for field, told in schema.get("properties", {}).items()
        if (field.endswith("_at") or field == "at") and "date-time" not in json.dumps(told)
    }
    assert plain == {"OrderedStep.scheduled_at"}


def test_every_reference_leads_somewhere():
    named = set(re.findall(r'"\$ref": "#/components/(\w+/\w+)"', json.dumps(DOCUMENT)))
    there = {f"{kind}/{name}" for kind, parts in DOCUMENT["components"].items() for name in parts}
    assert named <= there
    assert {f"schemas/{name}" for name in ("Measurement", "EstimateResource", "Device", "Health", "Problem")} <= named


def test_no_request_names_an_address_to_connect_to():
    """Where the probe connects to is a setting: no parameter and no field of a request is an address, but `Host`."""
    bodies = json.dumps([one["requestBody"] for one in OPERATIONS.values() if "requestBody" in one])
    named = {one["name"] for operation in OPERATIONS.values() for one in operation.get("parameters", ())}
    waiting = re.findall(r"schemas/(\w+)", bodies)
    seen = set()
    while waiting:
        name = waiting.pop()
        schema = DOCUMENT["components"]["schemas"][name]
        assert schema.get("format") not in ("uri", "hostname", "ipv4", "ipv6")
        named |= set(schema.get("properties", {}))
        seen.add(name)
        waiting += [one for one in re.findall(r"schemas/(\w+)", json.dumps(schema)) if one not in seen]
    assert {"ExamContent", "PressRequest", "ScheduledExam"} <= seen
    assert not [name for name in named if re.search(r"ur[il]|host|addr|callback|hook|target|port$", name.lower())]
