"""Lists of what was kept: newest first, page by page without loss or repetition, and only what was asked for."""

import pytest
from kept_measurements import keep, taken

from device.records.exams import ExamContent
from device.records.listing import Wanted
from device.records.store import Store


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


@pytest.fixture
def exam(store):
    return store.exams.make(ExamContent(kind="patient", patient_ref="A-17", operator="Ada"))


@pytest.fixture
def seven(store, exam):
    """Seven measurements: the even ones of the exam, every third in mode quick, the last without an answer."""
    for number in range(1, 8):
        keep(
            store, number, exam_id=None if number % 2 else exam["id"],
            mode="standard" if number % 3 else "quick", status="no_contact" if number == 7 else "ok",
        )  # fmt: skip
    return store


def ids(page):
    return [int(one["id"].split("-")[1]) for one in page.records]


@pytest.mark.parametrize("kind", ["measurements", "presses"])
@pytest.mark.parametrize("limit", [1, 2, 3, 6, 7, 8])
def test_pages_hold_everything_once_newest_first(seven, kind, limit):
    listed, found, before = getattr(seven.listing, kind), [], {}
    while True:
        page = listed(Wanted(), limit=limit, **before)
        found += ids(page)
        if page.next_before is None:
            break
        before = {"before": page.next_before}
        assert len(page.records) == limit
    assert found == [7, 6, 5, 4, 3, 2, 1]


@pytest.mark.parametrize("kind", ["measurements", "presses"])
def test_a_list_is_of_an_exam_a_time_and_a_mode(seven, exam, kind):
    def listed(**wanted):
        return ids(getattr(seven.listing, kind)(Wanted(**wanted), limit=99))

    assert listed(exam_id=exam["id"]) == [6, 4, 2]
    assert listed(mode="quick") == [6, 3]
    assert listed(since=taken(5)) == [7, 6, 5]
    assert listed(until=taken(3)) == [2, 1]
    assert listed(since=taken(3), until=taken(5), mode="standard", exam_id=exam["id"]) == [4]
    assert listed(exam_id="none") == []


def test_a_list_is_of_an_outcome(seven):
    assert ids(seven.listing.measurements(Wanted(outcome="no_contact"), limit=99)) == [7]
    seven.save_press({"id": "p-8", "state": "cancelled"})
    assert ids(seven.listing.presses(Wanted(outcome="cancelled"), limit=99)) == [8]
    assert ids(seven.listing.presses(Wanted(outcome="done"), limit=99)) == [7, 6, 5, 4, 3, 2, 1]


def test_a_measurement_is_listed_in_the_exam_it_was_moved_to_as_it_is_read(seven, exam):
    seven.exams.move("m-3", exam["id"], version=1, by="Ada", reason="Hers")
    page = seven.listing.measurements(Wanted(exam_id=exam["id"]), limit=99)
    assert ids(page) == [6, 4, 3, 2]
    assert page.records == [seven.measurement(one["id"]) for one in page.records]


def test_a_press_that_goes_on_comes_first(seven):
    for state in ("waiting", "capturing"):
        seven.save_press({"id": "p-9", "state": state})
        page = seven.listing.presses(Wanted(), limit=1)
        assert (ids(page), page.records[0]["state"]) == ([9], state)


def test_exams_are_listed_by_patient_order_kind_and_time(store, exam):
    other = store.exams.make(ExamContent(kind="patient", patient_ref="B-2", order_number="4711", operator="Ada"))
    phantom = store.exams.make(ExamContent(kind="phantom", operator="Ada"))

    def listed(wanted=None, kind="patient", **named):
        return [one["id"] for one in store.listing.exams(wanted or Wanted(), kind=kind, limit=9, **named).records]

    assert listed() == [other["id"], exam["id"]]
    assert listed(patient_ref="A-17") == [exam["id"]]
    assert listed(order_number="4711") == [other["id"]]
    assert listed(kind="phantom") == [phantom["id"]]
    assert listed(Wanted(since="9999-01-01T00:00:00.000Z")) == []
    assert store.listing.exams(Wanted(), kind="patient", limit=1).next_before == other["seq"]


def test_one_number_of_two_issuers_is_two_patients_and_of_none_is_a_third(store):
    content = ExamContent(kind="patient", patient_ref="4711", operator="Ada")
    of = {issuer: store.exams.make(content, issuer=issuer or None)["id"] for issuer in ("A", "B", "")}
    store.exams.make(ExamContent(kind="patient", patient_ref="0815", operator="Ada"), issuer="A")

    def listed(**named):
        return store.listing.exams(Wanted(), kind="patient", limit=9, **named).records

    everyone = listed(patient_ref="4711")
    assert {one["id"]: one["patient_issuer"] for one in everyone} == {of["A"]: "A", of["B"]: "B", of[""]: None}
    for issuer, exam_id in of.items():
        assert [one["id"] for one in listed(patient_ref="4711", patient_issuer=issuer)] == [exam_id]
    assert len(listed(patient_issuer="A")) == 2
    assert listed(patient_ref="4711", patient_issuer="C") == []


def test_a_change_that_is_told_says_the_issuer(store):
    content = ExamContent(kind="patient", patient_ref="4711", operator="Ada")
    made = store.exams.make(content, issuer="A")
    assert [one.record for one in store.listing.changes(after=0, limit=9) if one.kind == "exam"][-1] == made


@pytest.mark.parametrize(
    ("listed", "wanted", "more"),
    [
        ("measurements", Wanted(mode="quick"), {}),
        ("measurements", Wanted(outcome="ok"), {}),
        ("measurements", Wanted(exam_id="e"), {}),
        ("measurements", Wanted(since=taken(1)), {}),
        ("measurements", Wanted(until=taken(2)), {}),
        ("measurements", Wanted(mode="quick", since=taken(1), until=taken(2)), {}),
        ("presses", Wanted(exam_id="e"), {}),
        ("presses", Wanted(until=taken(2)), {}),
        ("exams", Wanted(), {"kind": "patient", "patient_ref": "A-17"}),
        ("exams", Wanted(), {"kind": "patient", "patient_ref": "A-17", "patient_issuer": "A"}),
        ("exams", Wanted(), {"kind": "patient", "order_number": "4711"}),
        ("exams", Wanted(until=taken(2)), {"kind": "patient"}),
    ],
)
def test_a_filter_is_looked_up_and_not_read_record_by_record(seven, listed, wanted, more):
    asked = []
    seven._db.set_trace_callback(asked.append)
    getattr(seven.listing, listed)(wanted, limit=3, **more)
    seven._db.set_trace_callback(None)
    [query] = [one for one in asked if one.startswith("SELECT")]
    plan = [row[3] for row in seven._db.execute(f"EXPLAIN QUERY PLAN {query}")]
    assert not [line for line in plan if line.startswith("SCAN")], plan
    assert [line for line in plan if "_by_" in line], plan


def test_an_older_store_is_indexed_when_it_is_opened_and_one_that_cannot_be_still_opens(seven, caplog):
    folder = seven.folder
    names = [name for (name,) in seven._db.execute("SELECT name FROM sqlite_master WHERE name LIKE 'measurement_by%'")]
    assert len(names) == 3
    for name in names:
        seven._db.execute(f"DROP INDEX {name}")
    seven._db.commit()
    seven.close()
    again = Store(folder)
    assert again._db.execute("SELECT count(*) FROM sqlite_master WHERE name LIKE 'measurement_by%'").fetchone() == (3,)
    assert again.listing.measurements(Wanted(mode="quick"), limit=9).records
    for name in names:
        again._db.execute(f"DROP INDEX {name}")
    again._db.execute("CREATE TABLE measurement_by_time (x)")  # so the index cannot be made
    again._db.commit()
    again.close()
    last = Store(folder)
    assert "lists are slow without their indexes" in caplog.text
    assert ids(last.listing.measurements(Wanted(until=taken(3)), limit=9)) == [2, 1]
    last.close()
