"""Lists over REST: followed by `next` to their end, filtered, and refused where what is asked for is none."""

import pytest
from kept_measurements import keep, taken

from device.records.exams import ExamContent
from device.web import schema


@pytest.fixture(autouse=True)
def _kept(store):
    for number in range(1, 6):
        store.exams.make(ExamContent(kind="patient", patient_ref=f"A-{number}", operator="Ada"))
        keep(store, number, mode="quick" if number == 2 else "standard")


LISTS = {
    "measurements": ("measurements", schema.MeasurementList),
    "presses": ("presses", schema.PressList),
    "exams": ("exams", schema.ExamList),
    "audit": ("entries", schema.AuditList),
}


@pytest.mark.parametrize("path", LISTS)
def test_a_list_is_followed_by_its_cursor_to_the_end(get, path):
    name, model = LISTS[path]
    whole = get(path, limit=200).json()
    assert whole["next"] is None
    found, cursor = [], {}
    while cursor is not None:
        answer = get(path, limit=2, **cursor).json()
        model.model_validate(answer)
        assert len(answer[name]) == 2 or answer["next"] is None
        found += answer[name]
        cursor = {"cursor": answer["next"]} if answer["next"] else None
    assert found == whole[name]
    assert len(found) >= 5


def test_a_list_still_takes_the_number_of_the_last_record(get):
    all_of_them = get("measurements").json()["measurements"]
    answer = get("measurements", before_seq=all_of_them[1]["seq"], limit=2).json()
    assert answer["measurements"] == all_of_them[2:4]


@pytest.mark.parametrize(
    ("query", "found"),
    [
        ({"mode": "quick"}, ["m-2"]),
        ({"outcome": "ok"}, []),
        ({"outcome": "partly_identifiable", "limit": 1}, ["m-5"]),
        ({"from": taken(4)}, ["m-5", "m-4"]),
        ({"after_seq": 3}, ["m-5", "m-4"]),
        ({"after_seq": 0, "from": taken(4)}, ["m-5", "m-4"]),
        ({"after_seq": 5}, []),
        ({"after_seq": 6, "limit": 1}, ["m-5"]),  # of before a backup was restored
        ({"to": "2026-03-04T11:02:00+01:00"}, ["m-1"]),
        ({"from": taken(2), "to": taken(3)}, ["m-2"]),
        ({"exam_id": "0b0f7f2e-6a1f-4d53-9d5e-0a8a4a2f6c11"}, []),
    ],
)
def test_a_list_is_of_what_was_asked_for(get, query, found):
    assert [one["id"] for one in get("measurements", **query).json()["measurements"]] == found


@pytest.mark.parametrize("path", LISTS)
@pytest.mark.parametrize(
    "query",
    [
        {"cursor": "0"}, {"cursor": "-1"}, {"cursor": str(2**63)}, {"cursor": ""}, {"cursor": "1 "},
        {"cursor": "\u0661"}, {"limit": "0"}, {"limit": "201"}, {"limit": "NaN"}, {"limit": "1e999"},
        {"before_seq": str(2**63)}, {"exam": "m-1"}, {"patient": "A-1"},
    ],
)  # fmt: skip
def test_a_page_that_is_none_and_a_filter_that_there_is_not_are_refused(get, path, query):
    answer = get(path, **query)
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")


def test_the_audit_is_listed_of_a_time(get):
    entries = get("audit", limit=200).json()["entries"]
    first = min(one["at"] for one in entries)
    assert get("audit", to=first).json()["entries"] == []
    assert get("audit", **{"from": first, "limit": 200}).json()["entries"] == entries
    later = [one for one in entries if one["at"] > first]
    found = get("audit", **{"from": later[-1]["at"], "to": "9999-01-01T00:00:00+01:00", "limit": 200}).json()
    assert found["entries"] == later


@pytest.mark.parametrize("path", LISTS)
@pytest.mark.parametrize(
    "moment",
    ["1700000000", "1e999", "NaN", "-Infinity", "2026-03-04", "2026-03-04T10:00:00", "0001-01-01T00:00:00+14:00",
     "9999-12-31T23:59:59-12:00", "2026-13-04T10:00:00Z", "\x00", ""],
)  # fmt: skip
def test_a_time_without_an_offset_or_out_of_the_calendar_is_refused(get, path, moment):
    answer = get(path, **{"from": moment})
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
