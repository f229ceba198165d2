"""The audit's chain: what was done is in it, and whoever goes around SQLite's refusals is found by the row."""

import hashlib
import json
import sqlite3
from contextlib import closing

import pytest

from device.errors import AuditChanged
from device.measurement.quantities import InvalidQuantity
from device.records.asked_once import ANSWERS_TABLE
from device.records.audit import FIRST, done_for, require_head, verify_chain
from device.records.exams import EXAM_TABLES, ExamContent
from device.records.migrations import FIRST_TABLES
from device.records.store import Store

PAGE = {"before_seq": 2**62, "limit": 99}
GUARDS = ("audit_is_never_changed", "audit_is_never_deleted")


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


def exam(store):
    return store.exams.make(ExamContent(kind="patient", patient_ref="A-17", operator="Ada"))


def press(store, press_id="p-1"):
    store.save_press({"id": press_id, "state": "waiting", "mode": "quick", "exam_id": None})
    store.save_press({"id": press_id, "state": "capturing", "mode": "quick", "exam_id": None})
    store.save_press({"id": press_id, "state": "done", "code": None, "measurement_id": "m-1"})


def tamper(store, *statements):
    """What somebody does who has the file, and knows of the refusals."""
    with closing(sqlite3.connect(store.folder / "tsis.sqlite")) as db:
        for trigger in GUARDS:
            db.execute(f"DROP TRIGGER {trigger}")
        for statement in statements:
            db.execute(statement)
        db.commit()


def filled(store):
    exam(store)
    press(store)
    store.tokens.make("PACS", "read", days=1)


def test_exams_presses_tokens_and_settings_are_in_it_with_who_asked(store):
    with done_for("Ward PC"):
        exam(store)
        press(store)
        token, _ = store.tokens.make("PACS", "read", days=1)
        store.tokens.revoke(token.id)
    store.audit.note_in_use({"press.target_n": 0.5})
    entries = store.audit.entries(**PAGE)[::-1]
    assert [entry["what"] for entry in entries] == [
        *("exam_made", "press_begun", "press_ended", "token_made", "token_revoked", "settings_changed")
    ]
    assert [entry["client"] for entry in entries] == ["Ward PC"] * 5 + ["probe"]
    assert [entry["by"] for entry in entries] == ["Ada"] + ["Ward PC"] * 4 + ["probe"]
    assert entries[2]["after"] == {"state": "done", "code": None, "measurement_id": "m-1"}


def test_settings_are_told_when_they_are_others_than_the_last_time(store):
    store.audit.note_in_use({"press.target_n": 0.5, "serial": "A"})
    store.audit.note_in_use({"press.target_n": 0.5, "serial": "A"})
    store.audit.note_in_use({"press.target_n": 0.6, "serial": "A"})
    last, first = store.audit.entries(subject="settings", **PAGE)
    assert (first["before"], last["before"]) == (None, {"press.target_n": 0.5})
    assert last["after"]["press.target_n"] == 0.6
    assert "serial" not in last["after"]


def test_the_chain_can_be_followed_by_anybody_who_reads_the_entries(store):
    filled(store)
    before = FIRST
    for entry in store.audit.entries(**PAGE)[::-1]:
        own = entry.pop("hash")
        canonical = json.dumps(entry, sort_keys=True, separators=(",", ":"))
        assert hashlib.sha256((before + canonical).encode()).hexdigest() == own
        before = own
    assert store.audit.verify().hash == before
    assert store.audit.warning() is None


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        ("UPDATE audit SET record = replace(record, 'A-17', 'B-18') WHERE seq = 1", "Row 1 .* not as it was written"),
        ("UPDATE audit SET subject = 'x' WHERE seq = 2", "Row 2 .* not as it was written"),
        ("UPDATE audit SET record = '[]' WHERE seq = 2", "Row 2 .* not as it was written"),
        ("UPDATE audit SET record = '{' WHERE seq = 2", "Row 2 .* not as it was written"),
        ("UPDATE audit SET hash = NULL WHERE seq = 3", "Row 3 .* not as it was written"),
        ("DELETE FROM audit WHERE seq = 2", "Row 2 .* is missing: the next one is 3"),
        ("DELETE FROM audit WHERE seq = 1", "Row 1 .* is missing"),
        ("DELETE FROM audit WHERE seq = 4", "ends with row 3, but 4 were written"),
        ("DELETE FROM audit", "ends with row 0, but 4 were written"),
        ("INSERT INTO audit SELECT 5, subject, record, hash FROM audit WHERE seq = 4", "Row 5 .* not as it was"),
    ],
)
def test_what_was_changed_is_found_and_its_row_named(store, statement, told):
    filled(store)
    store.close()
    tamper(store, statement)
    again = Store(store.folder)
    with pytest.raises(AuditChanged, match=told) as change:
        again.audit.verify()
    assert change.value.code == "E020"
    assert again.audit.warning().cause == change.value.cause
    press(again, "p-2")  # what is changed is told; the probe goes on
    with pytest.raises(AuditChanged):
        again.audit.verify()
    again.close()


def test_a_chain_that_was_written_anew_is_found_by_a_head_that_was_kept_elsewhere(store):
    filled(store)
    head = store.audit.verify()
    store.close()
    tamper(store, "DELETE FROM audit", "DELETE FROM sqlite_sequence WHERE name = 'audit'")
    again = Store(store.folder)
    exam(again)
    press(again, "p-2")
    again.tokens.make("PACS", "read", days=1)
    assert again.audit.verify().seq == head.seq
    with again._transaction() as db, pytest.raises(AuditChanged, match=f"Row {head.seq} of the audit has not the hash"):
        require_head(db, str(head))
    again.close()


@pytest.mark.parametrize("head", ["", "x", "99:00", "-1:0", "1", "1:", "1:" + 64 * "x"])
def test_what_is_no_head_is_a_slip_and_no_changed_audit(store, head):
    filled(store)
    with store._transaction() as db, pytest.raises(InvalidQuantity, match="must be SEQ:HASH"):
        require_head(db, head)


def test_a_head_of_more_rows_than_there_are_is_none_of_the_chain(store):
    filled(store)
    with store._transaction() as db, pytest.raises(AuditChanged, match="Row 99 of the audit"):
        require_head(db, f"99:{FIRST}")


OF_FORM_4 = """
CREATE TABLE audit (seq INTEGER PRIMARY KEY AUTOINCREMENT, subject TEXT NOT NULL, record TEXT NOT NULL);
CREATE INDEX audit_by_subject ON audit (subject);
CREATE TRIGGER audit_is_never_changed BEFORE UPDATE ON audit
  BEGIN SELECT RAISE(ABORT, 'an entry of the audit is never changed'); END;
CREATE TRIGGER audit_is_never_deleted BEFORE DELETE ON audit
  BEGIN SELECT RAISE(ABORT, 'an entry of the audit is never deleted'); END;
INSERT INTO audit (subject, record) VALUES
  ('e-1', '{"at": "2026-11-01T08:00:00.000Z", "by": "Ada", "what": "exam_made", "subject": "e-1", "reason": "",
    "before": null, "after": {"kind": "phantom"}}'),
  ('e-1', '{"at": "2026-11-01T09:00:00.000Z", "by": "Bo", "what": "exam_changed", "subject": "e-1", "reason": "No",
    "before": {"note": ""}, "after": {"note": "Two"}}');
PRAGMA user_version = 4;
"""


def test_the_audit_of_an_earlier_release_is_chained_as_it_is_found_and_goes_on(tmp_path):
    with closing(sqlite3.connect(tmp_path / "tsis.sqlite")) as db:
        db.executescript(FIRST_TABLES + ANSWERS_TABLE + EXAM_TABLES + OF_FORM_4)
    store = Store(tmp_path)
    assert store.audit.verify().seq == 2
    exam(store)
    assert [entry["by"] for entry in store.audit.entries(**PAGE)] == ["Ada", "Bo", "Ada"]
    assert store.audit.verify().seq == 3
    for statement in ("UPDATE audit SET subject = 'x'", "DELETE FROM audit"):
        with pytest.raises(sqlite3.IntegrityError, match="is never"):
            store._db.execute(statement)
    store.close()
    with closing(sqlite3.connect(f"file:{tmp_path}/tsis.sqlite?mode=ro", uri=True)) as db:
        assert verify_chain(db).seq == 3
