"""Exams over REST: bad input is refused and leaves the store as it was, and so is whoever has seen an older version."""

import asyncio
import json
import types
from datetime import UTC, datetime, timedelta

import httpx
import pytest
from probe_card import add_measurement

from device.records.audit import recorded
from device.records.exams import ExamContent
from device.web import schema
from device.web.app import create_app

EXAM = {"kind": "patient", "patient_ref": "A-17", "side": "left", "clock_position": 10, "operator": "Ada"}
ACT = {"by": "Ada", "reason": "Mixed up"}
PAGE = {"before_seq": 2**62, "limit": 99}


@pytest.fixture
def ask(store):
    app = create_app(types.SimpleNamespace(), store)

    def asking(method, path, body=None, *, seen=None, content=None, headers=None):
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                of_all = {"content-type": "application/json", **(headers or {})}
                if seen is not None:
                    of_all["if-match"] = seen
                sent = content if content is not None else json.dumps(body)
                return await client.request(method, f"/api/v1/{path}", headers=of_all, content=sent)

        return asyncio.run(answer())

    return asking


@pytest.fixture
def exam(ask):
    return ask("POST", "exams", EXAM).json()


def everything(store):
    """What the tables of people's acts hold."""
    return [
        store._db.execute(f"SELECT * FROM {table}").fetchall() for table in ("exam", "filing", "audit", "asked_once")
    ]


def test_an_exam_is_made_read_and_listed(ask):
    made = ask("POST", "exams", EXAM)
    assert (made.status_code, made.headers["etag"]) == (201, '"1"')
    assert schema.Exam.model_validate(made.json()).clock_position == 10
    found = ask("GET", made.headers["location"].removeprefix("/api/v1/"))
    assert (found.status_code, found.headers["etag"], found.json()) == (200, '"1"', made.json())
    assert ask("GET", "exams?patient_ref=A-17").json() == {"exams": [made.json()], "next": None}
    assert ask("GET", "exams?kind=phantom").json() == {"exams": [], "next": None}


def test_a_number_alone_finds_the_exams_of_every_issuer_and_each_says_which(ask, store):
    content = ExamContent(kind="patient", patient_ref="4711", operator="Ada")
    for issuer in ("HOSPITAL A", "HOSPITAL B", None):
        store.exams.make(content, issuer=issuer)

    def issuers(filters):
        found = ask("GET", f"exams?patient_ref=4711{filters}").json()["exams"]
        return [schema.Exam.model_validate(one).patient_issuer for one in found]

    assert issuers("") == [None, "HOSPITAL B", "HOSPITAL A"]
    assert issuers("&patient_issuer=HOSPITAL%20A") == ["HOSPITAL A"]
    assert issuers("&patient_issuer=") == [None]
    assert issuers("&patient_issuer=HOSPITAL") == []


@pytest.mark.parametrize("method", ["POST", "PATCH"])
def test_who_has_issued_a_number_is_not_said_by_hand(ask, exam, store, method):
    said = {"patient_issuer": "HOSPITAL A"}
    body, path = (EXAM | said, "exams") if method == "POST" else (ACT | {"changes": said}, f"exams/{exam['id']}")
    before = everything(store)
    refused = ask(method, path, body, seen='"1"')
    assert (refused.status_code, refused.json()["code"], everything(store)) == (422, "E803", before)


PLACE = {"operator": "Bo", "side": "right", "clock_position": 2, "nipple_distance_mm": 30.0, "note": "Second"}


def test_an_exam_at_another_place_is_of_the_same_patient_and_order_once_for_a_key(ask, store):
    exam = ask("POST", "exams", EXAM | {"order_number": "2026/1", "nipple_distance_mm": 10.0, "note": "First"}).json()
    path, key = f"exams/{exam['id']}/another-place", {"Idempotency-Key": "k-7"}
    made, again = (ask("POST", path, PLACE, seen='"1"', headers=key) for _ in range(2))
    assert (made.status_code, made.headers["etag"], again.content) == (201, '"1"', made.content)
    found = made.json()
    assert {name: found[name] for name in PLACE} == PLACE
    assert (found["kind"], found["patient_ref"], found["order_number"]) == ("patient", "A-17", "2026/1")
    assert ask("GET", made.headers["location"].removeprefix("/api/v1/")).json() == found
    assert len(store.exams.exams(**PAGE)) == 2


@pytest.mark.parametrize(
    ("body", "seen", "status", "code"),
    [
        (PLACE, '"2"', 412, "E811"),
        (PLACE, None, 422, "E803"),
        ({**PLACE, "patient_ref": "B-1"}, '"1"', 422, "E803"),
        ({**PLACE, "clock_position": 13}, '"1"', 422, "E803"),
        ({"side": "left"}, '"1"', 422, "E803"),
    ],
)
def test_another_place_of_an_exam_that_is_not_as_it_was_seen_or_of_nobody_is_refused(
    ask, exam, store, body, seen, status, code
):
    before = everything(store)
    refused = ask("POST", f"exams/{exam['id']}/another-place", body, seen=seen)
    assert (refused.status_code, refused.json()["code"], everything(store)) == (status, code, before)
    unknown = ask("POST", "exams/0b0f7f2e-6a1f-4d53-9d5e-0a8a4a2f6c11/another-place", PLACE, seen='"1"')
    assert (unknown.status_code, unknown.json()["code"]) == (404, "E802")


@pytest.mark.parametrize(("days", "status"), [(6.9, 201), (7.1, 409)])
def test_another_place_of_an_exam_of_last_week_is_refused(ask, exam, store, days, status):
    begun = recorded(datetime.now(UTC) - timedelta(days=days))
    store._db.execute("UPDATE exam SET record = json_set(record, '$.made_at', ?)", (begun,))
    store._db.commit()
    answer = ask("POST", f"exams/{exam['id']}/another-place", PLACE, seen='"1"')
    assert (answer.status_code, answer.json().get("code")) == (status, "E815" if status == 409 else None)
    assert len(store.exams.exams(**PAGE)) == (2 if status == 201 else 1)


def test_a_phantom_has_no_other_place_but_another_exam(ask):
    exam = ask("POST", "exams", {"kind": "phantom", "operator": "Ada"}).json()
    path = f"exams/{exam['id']}/another-place"
    assert ask("POST", path, PLACE, seen='"1"').status_code == 422
    assert ask("POST", path, {"operator": "Bo"}, seen='"1"').json()["kind"] == "phantom"


def test_an_exam_with_a_key_is_made_once(ask, store):
    first, again = (ask("POST", "exams", EXAM, headers={"Idempotency-Key": "k-1"}) for _ in range(2))
    other = ask("POST", "exams", EXAM | {"side": "right"}, headers={"Idempotency-Key": "k-1"})
    assert [(one.status_code, one.headers["location"], one.headers["etag"], one.content) for one in (first, again)] == [
        (201, f"/api/v1/exams/{first.json()['id']}", '"1"', first.content)
    ] * 2
    assert (other.status_code, other.json()["code"]) == (409, "E810")
    assert len(store.exams.exams(**PAGE)) == 1


def said(**fields):
    return json.dumps(EXAM | fields)


@pytest.mark.parametrize(
    "content",
    [
        said(clock_position=13), said(clock_position=0), said(clock_position=2.5), said(clock_position=True),
        said(clock_position="3"), said(clock_position=2**63), said(nipple_distance_mm=float("nan")),
        said(nipple_distance_mm=float("-inf")), said(nipple_distance_mm=-0.1), said(nipple_distance_mm=250.5),
        said(nipple_distance_mm=True), said(nipple_distance_mm=0)[:-2] + "1e999}", said(side="both"),
        said(kind="animal"), said(patient_ref=None), said(patient_ref=""), said(patient_ref=17),
        said(patient_ref="a\0b"), said(patient_ref="a\nb"), said(patient_ref=" A-17"), said(patient_ref="x" * 65),
        said(patient_ref="\ud800"), said(patient_ref="A\u202e71"), said(operator="\u0007"), said(operator=None),
        said(note="\0"), said(note="\udfff"), said(note="x" * 2001), said(order_number="\u200b"),
        said(patient_name="Ada"), said(**{"\ud800": 1}),
        said()[:-1] + ', "side": "right"}', said()[:-1] + ', "\\ud800": 1, "\\ud800": 2}',
        b'{"operator": "\xff"}', b"[" * 60_000, b"", b"null", b"[]", b'"exam"', b"{",
    ],
)  # fmt: skip
def test_what_is_no_exam_is_refused_and_the_store_stays(ask, store, exam, content):
    before = everything(store)
    made = ask("POST", "exams", content=content)
    assert (made.status_code, made.json()["code"]) == (422, "E803")
    assert made.headers["content-type"] == "application/problem+json"
    assert everything(store) == before


def test_a_key_that_is_there_twice_is_named(ask):
    told = ask("POST", "exams", content=said()[:-1] + ', "side": "right"}').json()["detail"]
    assert "the key 'side' is there twice" in told


def test_an_exam_is_changed_by_who_has_seen_it_as_it_is(ask, exam):
    path = f"exams/{exam['id']}"
    changed = ask("PATCH", path, {"changes": {"clock_position": 2, "note": "Moved"}, **ACT}, seen='"1"')
    assert (changed.status_code, changed.headers["etag"]) == (200, '"2"')
    assert changed.json() == exam | {
        "clock_position": 2, "note": "Moved", "version": 2, "changed_at": changed.json()["changed_at"]
    }  # fmt: skip
    assert ask("GET", path).json() == changed.json()


def test_a_tag_that_a_proxy_has_weakened_says_the_version_all_the_same(ask, exam):
    changed = ask("PATCH", f"exams/{exam['id']}", {"changes": {"side": "right"}, **ACT}, seen='W/"1"')
    assert (changed.status_code, changed.headers["etag"]) == (200, '"2"')


def test_a_key_of_a_change_is_another_requests_that_names_one_field_more(ask, exam):
    path, once = f"exams/{exam['id']}", {"Idempotency-Key": "k-8"}
    first = ask("PATCH", path, {"changes": {"clock_position": 3}, **ACT}, seen='"1"', headers=once)
    other = ask("PATCH", path, {"changes": {"clock_position": 3, "note": ""}, **ACT}, seen='"1"', headers=once)
    again = ask("PATCH", path, {"changes": {"clock_position": 3}, **ACT}, seen='"1"', headers=once)
    assert [one.status_code for one in (first, other, again)] == [200, 409, 200]
    assert again.json() == first.json()


@pytest.mark.parametrize("act", ["move", "void"])
def test_an_act_whose_answer_was_lost_is_answered_again_by_its_key(ask, store, exam, act):
    kept = add_measurement(store, 1)
    body = ACT | ({"exam_id": exam["id"]} if act == "move" else {})
    path, once = f"measurements/{kept['id']}/{act}", {"Idempotency-Key": "k-7"}
    first, again = (ask("POST", path, body, seen='"1"', headers=once) for _ in range(2))
    assert (first.status_code, again.status_code, again.json()) == (200, 200, first.json())
    assert again.headers["etag"] == first.headers["etag"] == '"2"'
    other = ask("POST", path, body, seen='"2"', headers=once)
    assert (other.status_code, other.json()["code"]) == (409, "E810")


@pytest.mark.parametrize(
    ("seen", "body", "status", "code"),
    [
        ('"2"', {"changes": {"side": "right"}, **ACT}, 412, "E811"),
        (None, {"changes": {"side": "right"}, **ACT}, 422, "E803"),
        ("1", {"changes": {"side": "right"}, **ACT}, 422, "E803"),
        ("*", {"changes": {"side": "right"}, **ACT}, 422, "E803"),
        ('"1", "2"', {"changes": {"side": "right"}, **ACT}, 422, "E803"),
        ('"99999999999999999999"', {"changes": {"side": "right"}, **ACT}, 422, "E803"),
        ('"1"', {"changes": {"side": "right"}, "by": "Ada"}, 422, "E803"),
        ('"1"', {"changes": {"side": "right"}, "by": "Ada", "reason": " "}, 422, "E803"),
        ('"1"', {"changes": {"side": "right"}, "by": "", "reason": "x"}, 422, "E803"),
        ('"1"', {"changes": {"clock_position": 13}, **ACT}, 422, "E803"),
        ('"1"', {"changes": {"version": 7}, **ACT}, 422, "E803"),
        ('"1"', {"changes": {"patient_ref": None}, **ACT}, 422, "E803"),
        ('"1"', {"changes": {"kind": "phantom"}, **ACT}, 422, "E803"),
    ],
)
def test_a_change_that_is_none_or_is_of_an_older_version_changes_nothing(ask, store, exam, seen, body, status, code):
    before = everything(store)
    answer = ask("PATCH", f"exams/{exam['id']}", body, seen=seen)
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert everything(store) == before


def test_a_measurement_is_moved_and_voided_with_its_version_and_audited(ask, store, exam):
    kept = add_measurement(store, 1)
    path = f"measurements/{kept['id']}"
    found = ask("GET", path)
    moved = ask("POST", f"{path}/move", {"exam_id": exam["id"], **ACT}, seen=found.headers["etag"])
    stale = ask("POST", f"{path}/void", ACT, seen=found.headers["etag"])
    voided = ask("POST", f"{path}/void", ACT, seen=moved.headers["etag"])
    assert [one.status_code for one in (found, moved, stale, voided)] == [200, 200, 412, 200]
    assert [one.headers["etag"] for one in (found, moved, voided)] == ['"1"', '"2"', '"3"']
    assert moved.json() == kept | {"exam_id": exam["id"], "version": 2}
    assert voided.json()["voided"]["reason"] == "Mixed up"
    assert ask("GET", f"measurements?exam_id={exam['id']}").json() == {"measurements": [voided.json()], "next": None}
    audit = schema.AuditList.model_validate(ask("GET", f"audit?subject={kept['id']}").json())
    assert [entry.what for entry in audit.entries] == ["measurement_voided", "measurement_moved"]
    told = [entry["what"] for entry in ask("GET", "audit").json()["entries"]]
    assert told == ["measurement_voided", "measurement_moved", "press_ended", "press_begun", "exam_made"]


@pytest.mark.parametrize(
    ("act", "body", "status"),
    [
        ("move", {"exam_id": "0b0f7f2e-6a1f-4d53-9d5e-0a8a4a2f6c11", **ACT}, 404), ("move", ACT, 422),
        ("move", {"exam_id": "none", **ACT}, 422), ("void", {"by": "Ada"}, 422),
        ("void", {"by": "Ada", "reason": ""}, 422),
        ("void", {"by": "Ada", "reason": "x" * 501}, 422), ("void", {**ACT, "exam_id": None}, 422),
    ],
)  # fmt: skip
def test_an_act_that_says_too_little_or_of_nothing_is_refused_and_the_store_stays(ask, store, act, body, status):
    kept = add_measurement(store, 1)
    before = everything(store)
    assert ask("POST", f"measurements/{kept['id']}/{act}", body, seen='"1"').status_code == status
    assert everything(store) == before
    assert store.measurement(kept["id"]) == kept


@pytest.mark.parametrize("path", ["exams/none", "exams/%ff"])
def test_an_exam_that_is_not_there_is_not_found(ask, path):
    answer = ask("GET", path)
    assert (answer.status_code, answer.json()["code"]) == (404, "E802")


@pytest.mark.parametrize("query", ["limit=0", "limit=201", "before_seq=9223372036854775808", "kind=all"])
def test_a_page_of_exams_that_is_none_is_refused(ask, query):
    assert ask("GET", f"exams?{query}").status_code == 422
