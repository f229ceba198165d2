"""Exams and the audit: what anybody changes is said with before and after, and nothing is changed unseen."""

import json
import sqlite3
import threading
from contextlib import closing

import pytest
from probe_card import add_measurement
from pydantic import ValidationError

from device.errors import InvalidRequest, ReusedKey, StaleVersion, StorageError, UnknownResource
from device.records.asked_once import AskedOnce
from device.records.exams import ExamContent
from device.records.store import Store

ACT = {"by": "Ada", "reason": "Mixed up"}
OF_A_PATIENT = {
    "kind": "patient", "patient_ref": "A-17", "order_number": "2026/1", "side": "left", "clock_position": 10,
    "nipple_distance_mm": 35.0, "operator": "Ada Byron", "note": "Two lines\nof what was felt",
}  # fmt: skip
PAGE = {"before_seq": 2**62, "limit": 99}


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


@pytest.fixture
def exam(store):
    return store.exams.make(ExamContent(**OF_A_PATIENT))


def of_phantom(store, **said):
    return store.exams.make(ExamContent(kind="phantom", operator="Ada", **said))


def test_an_exam_comes_back_as_it_was_made_also_after_a_restart(store, exam):
    assert {name: exam[name] for name in OF_A_PATIENT} == OF_A_PATIENT
    assert (exam["seq"], exam["version"], exam["made_at"]) == (1, 1, exam["changed_at"])
    assert exam["made_at"].endswith("Z")
    store.close()
    again = Store(store.folder)
    assert again.exams.exam(exam["id"]) == exam
    assert [entry["what"] for entry in again.audit.entries(**PAGE)] == ["exam_made"]
    again.close()


def test_exams_are_listed_newest_first_by_patient_and_order_and_phantoms_apart(store, exam):
    second = store.exams.make(ExamContent(kind="patient", patient_ref="A-17", operator="Ada"))
    other = store.exams.make(ExamContent(kind="patient", patient_ref="17", order_number="2026/1", operator="Ada"))
    phantom = of_phantom(store, order_number="2026/1")

    def ids(**asked):
        return [one["id"] for one in store.exams.exams(**{**PAGE, **asked})]

    assert ids() == [other["id"], second["id"], exam["id"]]
    assert ids(kind="phantom") == [phantom["id"]]
    assert ids(patient_ref="A-17") == [second["id"], exam["id"]]
    assert ids(order_number="2026/1") == [other["id"], exam["id"]]
    assert ids(patient_ref="A-17", order_number="2026/1") == [exam["id"]]
    assert ids(before_seq=second["seq"]) == [exam["id"]]
    assert ids(patient_ref="x' OR '1'='1") == []


OF_4711 = ExamContent(kind="patient", patient_ref="4711", operator="Ada")


def test_an_exam_says_who_has_issued_its_reference_also_after_a_change_and_a_restart(store, exam):
    assert exam["patient_issuer"] is None
    made = store.exams.make(OF_4711, issuer="HOSPITAL A")
    assert made["patient_issuer"] == "HOSPITAL A"
    changed = store.exams.change(made["id"], {"side": "left"}, version=1, **ACT)
    assert changed == made | {"side": "left", "version": 2, "changed_at": changed["changed_at"]}
    assert [entry["after"].get("patient_issuer") for entry in store.audit.entries(subject=made["id"], **PAGE)] == [
        None,
        "HOSPITAL A",
    ]
    store.close()
    again = Store(store.folder)
    assert again.exams.exam(made["id"]) == changed
    assert again.exams.exams(patient_ref="4711", **PAGE) == [changed]
    again.close()


def test_an_issuer_holds_for_the_reference_it_was_said_of_and_comes_back_with_it(store):
    made = store.exams.make(OF_4711, issuer="HOSPITAL A")
    wrong = store.exams.change(made["id"], {"patient_ref": "0815"}, version=1, **ACT)
    assert wrong["patient_issuer"] is None
    entry = store.audit.entries(subject=made["id"], **PAGE)[0]
    assert entry["before"] == {"patient_ref": "4711", "patient_issuer": "HOSPITAL A"}
    assert entry["after"] == {"patient_ref": "0815", "patient_issuer": None}
    assert store.exams.change(made["id"], {"patient_ref": "4711"}, version=2, **ACT)["patient_issuer"] == "HOSPITAL A"


def test_an_exam_that_is_made_once_says_its_issuer_each_time(store):
    once = AskedOnce("k-2", "POST exams")
    first = store.exams.make(OF_4711, once, issuer="HOSPITAL A")
    assert store.exams.make(OF_4711, once, issuer="HOSPITAL A") == first == store.exams.exam(first["id"])


def test_an_exam_is_made_once_for_one_key(store):
    once = AskedOnce("k-1", "POST exams")
    first = store.exams.make(ExamContent(**OF_A_PATIENT), once)
    assert store.exams.make(ExamContent(**OF_A_PATIENT), once) == first
    assert store.exams.exams(**PAGE) == [first]
    assert len(store.audit.entries(**PAGE)) == 1


def test_a_change_is_the_next_version_and_its_entry_has_before_and_after(store, exam):
    changes = {"side": "right", "clock_position": 2, "note": exam["note"]}
    changed = store.exams.change(exam["id"], changes, version=1, by="Bo", reason="Wrong side")
    assert changed == exam | changes | {"version": 2, "changed_at": changed["changed_at"]}
    assert store.exams.exam(exam["id"]) == changed
    entry, made = store.audit.entries(subject=exam["id"], **PAGE)
    assert (entry["by"], entry["what"], entry["reason"]) == ("Bo", "exam_changed", "Wrong side")
    assert entry["before"] == {"side": "left", "clock_position": 10}
    assert entry["after"] == {"side": "right", "clock_position": 2}
    assert (made["by"], made["before"], made["after"]) == ("Ada Byron", None, OF_A_PATIENT)


def test_a_distance_of_minus_nought_is_nought(store):
    made = store.exams.make(ExamContent(kind="patient", patient_ref="A", operator="Ada", nipple_distance_mm=-0.0))
    assert str(store.exams.exam(made["id"])["nipple_distance_mm"]) == "0.0"


def test_what_changes_nothing_is_no_version(store, exam):
    assert store.exams.change(exam["id"], {"side": "left"}, version=1, **ACT) == exam
    assert len(store.audit.entries(**PAGE)) == 1


def test_a_change_of_what_somebody_else_has_changed_meanwhile_is_refused(store, exam):
    changed = store.exams.change(exam["id"], {"patient_ref": "B-1"}, version=1, by="Bo", reason="Another patient")
    with pytest.raises(StaleVersion, match="has the version 2: it was changed since the version 1") as refusal:
        store.exams.change(exam["id"], {"side": "right"}, version=1, **ACT)
    assert (refusal.value.code, refusal.value.status) == ("E811", 412)
    with pytest.raises(StaleVersion):
        store.exams.exam(exam["id"], version=1)
    assert store.exams.exam(exam["id"], version=2) == changed
    assert len(store.audit.entries(**PAGE)) == 2


def test_of_many_who_change_one_version_at_once_one_does(store, exam):
    outcomes = []

    def change(hour):
        try:
            outcomes.append(store.exams.change(exam["id"], {"clock_position": hour}, version=1, **ACT))
        except StaleVersion:
            outcomes.append(None)

    threads = [threading.Thread(target=change, args=(hour,)) for hour in range(1, 9)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    [changed] = [one for one in outcomes if one]
    assert store.exams.exam(exam["id"]) == changed
    assert len(store.audit.entries(**PAGE)) == 2


@pytest.mark.parametrize(
    ("changes", "told"),
    [({"patient_ref": None}, "needs a patient_ref"), ({"kind": "phantom"}, "of a phantom has no patient_ref"),
     ({"kind": None}, "exam.kind"), ({"operator": None}, "exam.operator")],
)  # fmt: skip
def test_a_change_after_which_it_is_no_exam_is_refused_and_nothing_is_changed(store, exam, changes, told):
    with pytest.raises(InvalidRequest, match=told):
        store.exams.change(exam["id"], changes, version=1, **ACT)
    assert store.exams.exam(exam["id"]) == exam
    assert len(store.audit.entries(**PAGE)) == 1


@pytest.mark.parametrize(
    "said",
    [{"patient_ref": "A-1"}, {"side": "left"}, {"clock_position": 3}, {"nipple_distance_mm": 0.0}],
)
def test_a_phantom_has_nothing_of_a_patients(said):
    with pytest.raises(ValidationError, match=f"has no {next(iter(said))}"):
        ExamContent(kind="phantom", operator="Ada", **said)


@pytest.mark.parametrize("text", ["Zoë Ångström", "李小龍", "مریم می\u200cروم", "A-1/2026 #4", "x" * 64])
def test_a_reference_is_kept_as_it_was_typed_in_any_script(store, text):
    made = store.exams.make(ExamContent(kind="patient", patient_ref=text, operator=text))
    assert store.exams.exams(patient_ref=text, **PAGE) == [made]


def test_a_measurement_is_moved_and_voided_beside_what_was_measured(store, exam):
    """The row of the measurement stays as it was, to the last byte."""
    kept = add_measurement(store, 1)
    with closing(sqlite3.connect(store.folder / "tsis.sqlite")) as db:
        row = db.execute("SELECT * FROM measurement").fetchall()
        store.exams.move(kept["id"], exam["id"], version=1, **ACT)
        store.exams.void(kept["id"], version=2, by="Bo", reason="The probe slipped")
        store.exams.move(kept["id"], None, version=3, **ACT)
        assert db.execute("SELECT * FROM measurement").fetchall() == row
    found = store.measurement(kept["id"])
    voided = {"at": found["voided"]["at"], "by": "Bo", "reason": "The probe slipped"}
    assert found == kept | {"exam_id": None, "voided": voided, "version": 4}
    told = [
        (one["by"], one["what"], one["before"], one["after"]) for one in store.audit.entries(subject=kept["id"], **PAGE)
    ]
    assert told == [
        ("Ada", "measurement_moved", {"exam_id": exam["id"]}, {"exam_id": None}),
        ("Bo", "measurement_voided", {"voided": None}, {"voided": voided}),
        ("Ada", "measurement_moved", {"exam_id": None}, {"exam_id": exam["id"]}),
    ]


def test_a_measurement_that_is_moved_to_where_it_is_stays_as_it_is_and_nobody_is_told(store, exam):
    kept = add_measurement(store, 1)
    store.exams.move(kept["id"], exam["id"], version=1, **ACT)
    moved, told = store.measurement(kept["id"]), store.audit.entries(**PAGE)
    store.exams.move(kept["id"], exam["id"], version=2, **ACT)
    assert (store.measurement(kept["id"]), store.audit.entries(**PAGE)) == (moved, told)


def test_a_note_has_lines_however_they_end_and_what_cannot_be_printed_is_named(store):
    said = {"kind": "patient", "patient_ref": "A-17", "operator": "Ada", "side": "left"}
    assert ExamContent(**said, note="one\r\ntwo\nthree").note == "one\ntwo\nthree"
    assert ExamContent(**said, note="one\n\ttwo\u00a0three").note == "one\n\ttwo\u00a0three"
    with pytest.raises(ValueError, match=r"character 4 is '\\x07'"):
        ExamContent(**said, note="one\ntwo\x07three")
    for note in ("latex\x1f", "\x0ca", "a\x85", "a\u2028", "a\r"):
        with pytest.raises(ValueError, match="must be of characters that can be printed"):
            ExamContent(**said, note=note)


def test_people_have_the_spaces_of_their_script_and_identifiers_none_that_looks_like_another(store):
    said = {"kind": "patient", "patient_ref": "A-17", "operator": "Ada", "side": "left"}
    assert ExamContent(**said | {"operator": "山田\u3000太郎"}).operator == "山田\u3000太郎"
    for name, text in (
        ("patient_ref", "A\u00a017"),
        ("operator", "Ada\u3000"),
        ("operator", "A\u200bB"),
        ("operator", "A\tB"),
    ):
        with pytest.raises(ValueError, match=name):
            ExamContent(**said | {name: text})


@pytest.mark.parametrize("act", ["change", "move", "void"])
def test_an_act_that_is_asked_for_twice_by_one_key_is_done_once(store, exam, act):
    """Its first answer was lost on the way: who asks again has not been overtaken by himself."""
    kept, once = add_measurement(store, 1), AskedOnce("k-1", act)
    acts = {
        "change": lambda once: store.exams.change(exam["id"], {"side": "right"}, version=1, once=once, **ACT),
        "move": lambda once: store.exams.move(kept["id"], exam["id"], version=1, once=once, **ACT),
        "void": lambda once: store.exams.void(kept["id"], version=1, once=once, **ACT),
    }
    first = acts[act](once)
    told = store.audit.entries(**PAGE)
    assert acts[act](once) == first
    assert store.audit.entries(**PAGE) == told
    with pytest.raises(ReusedKey):
        acts[act](AskedOnce("k-1", "another"))
    for _ in range(2):  # what was refused leaves no key
        with pytest.raises(StaleVersion):
            acts[act](AskedOnce("k-2", act))


def test_the_measurements_of_an_exam_are_those_that_are_in_it_now(store, exam):
    first, second = add_measurement(store, 1), add_measurement(store, 2)
    other = of_phantom(store)
    for one in (first, second):
        store.exams.move(one["id"], exam["id"], version=1, **ACT)
    store.exams.move(first["id"], other["id"], version=2, **ACT)
    assert [one["id"] for one in store.measurements(exam_id=exam["id"], **PAGE)] == [second["id"]]
    assert [one["id"] for one in store.measurements(exam_id=other["id"], **PAGE)] == [first["id"]]
    assert len(store.measurements(**PAGE)) == 2


def test_void_measurements_of_an_exam_are_counted_apart(store, exam):
    kept = [add_measurement(store, number)["id"] for number in (1, 2, 3)]
    for one in kept:
        store.exams.move(one, exam["id"], version=1, **ACT)
    store.exams.void(kept[0], version=2, **ACT)
    assert store.listing.measurements_of(exam["id"]) == (2, 1)
    assert store.listing.measurements_of("none") == (0, 0)


def test_a_measurement_is_not_moved_to_nowhere_nor_unseen_nor_voided_twice(store, exam):
    kept = add_measurement(store, 1)
    with pytest.raises(UnknownResource, match="no exam none"):
        store.exams.move(kept["id"], "none", version=1, **ACT)
    with pytest.raises(UnknownResource, match="no measurement none"):
        store.exams.move("none", exam["id"], version=1, **ACT)
    for act in (store.exams.void, lambda *told, **more: store.exams.move(*told, exam["id"], **more)):
        with pytest.raises(StaleVersion):
            act(kept["id"], version=2, **ACT)
    assert store.measurement(kept["id"]) == kept
    store.exams.void(kept["id"], version=1, **ACT)
    with pytest.raises(InvalidRequest, match="void already"):
        store.exams.void(kept["id"], version=2, **ACT)
    told = [entry["what"] for entry in store.audit.entries(**PAGE)]
    assert [what for what in told if not what.startswith("press_")] == ["measurement_voided", "exam_made"]


@pytest.mark.parametrize("act", ["UPDATE audit SET record = '{}'", "DELETE FROM audit"])
def test_an_entry_of_the_audit_is_neither_changed_nor_deleted(store, exam, act):
    before = store.audit.entries(**PAGE)
    with closing(sqlite3.connect(store.folder / "tsis.sqlite")) as db, pytest.raises(sqlite3.IntegrityError):
        db.execute(act)
    assert store.audit.entries(**PAGE) == before


def test_what_cannot_be_audited_is_not_done(store, exam):
    kept = add_measurement(store, 1)
    before = store.audit.entries(**PAGE)
    store._db.execute("CREATE TRIGGER audit_is_full BEFORE INSERT ON audit BEGIN SELECT RAISE(ABORT, 'full'); END")
    acts = [
        lambda: of_phantom(store),
        lambda: store.exams.change(exam["id"], {"side": "right"}, version=1, **ACT),
        lambda: store.exams.move(kept["id"], exam["id"], version=1, **ACT),
        lambda: store.exams.void(kept["id"], version=1, **ACT),
    ]
    for act in acts:
        with pytest.raises(StorageError, match="full"):
            act()
    assert store.exams.exams(**PAGE) == [exam]
    assert store.exams.exams(kind="phantom", **PAGE) == []
    assert store.measurement(kept["id"]) == kept
    assert store.audit.entries(**PAGE) == before


def test_the_audit_is_read_in_pages(store, exam):
    for hour in range(1, 5):
        store.exams.change(exam["id"], {"clock_position": hour}, version=hour, **ACT)
    first = store.audit.entries(before_seq=2**62, limit=2)
    rest = store.audit.entries(before_seq=first[-1]["seq"], limit=9)
    assert [json.dumps(one["after"].get("clock_position")) for one in first + rest] == ["4", "3", "2", "1", "10"]
