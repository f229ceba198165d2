"""A notice: what it says, what it never says, and a signature that other libraries verify."""

import base64
import json
from typing import get_args

import pytest
from notice_receiver import SECRET, write_secret
from written_exam import begin, measure

from device.errors import WebhookFailed
from device.records.audit import AuditedAct, append
from device.records.retention import RetentionRule
from device.records.store import Store
from device.webhook.notice import TYPES, Notice, notice_of, read_secret, signed_headers


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


def test_the_signature_is_that_of_the_published_example():
    """The example of Standard Webhooks' own libraries."""
    secret = base64.b64decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw")
    notice = Notice("msg_p5jXN8AQM9LWM0D4loKWxJek", "test", b'{"test": 2432232314}')
    assert signed_headers(notice, secret, 1614265330) == {
        "webhook-id": "msg_p5jXN8AQM9LWM0D4loKWxJek",
        "webhook-timestamp": "1614265330",
        "webhook-signature": "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=",
    }


def test_it_says_what_was_done_to_which_record_and_where_that_is_read(store):
    exam = begin(store)
    measured = measure(store, exam)
    store.exams.void(measured["id"], version=1, by="Ada Byron", reason="Slipped")
    made, voided = store.listing.changes(after=0, limit=9)
    assert json.loads(notice_of(made, "TSIS-0042").body) == {
        "type": "exam.made", "timestamp": made.at,
        "data": {"serial": "TSIS-0042", "number": made.number, "id": exam["id"], "version": 1, "kind": "patient",
                 "href": f"/api/v1/exams/{exam['id']}"},
    }  # fmt: skip
    said = json.loads(notice_of(voided, "TSIS-0042").body)
    assert (said["type"], said["data"]["voided"], said["data"]["version"]) == ("measurement.voided", True, 2)
    assert said["data"]["href"] == f"/api/v1/measurements/{measured['id']}"


def test_it_says_neither_patient_nor_order_nor_person_nor_place_nor_number(store):
    exam = begin(store)
    measured = measure(store, exam)
    store.exams.move(measured["id"], None, version=1, by="Ada Byron", reason="Another patient's")
    store.exams.change(exam["id"], {"note": "Zwei"}, version=1, by="Ada Byron", reason="Mistyped")
    for change in store.listing.changes(after=0, limit=9):
        said = json.loads(notice_of(change, "S").body)["data"]
        assert said.keys() <= {
            "serial", "number", "id", "href", "version", "kind", "taken_at", "mode", "exam_id", "status", "simulated",
            "voided",
        }  # fmt: skip


@pytest.mark.parametrize("simulated", [False, True])
def test_it_says_whether_a_press_was_simulated(store, simulated):
    """So that a receiver takes no number of a simulated probe for a patient's."""
    measured = measure(store, begin(store), simulated=simulated)
    store.exams.void(measured["id"], version=1, by="Ada Byron", reason="Slipped")
    voided = store.listing.changes(after=0, limit=9)[-1]
    assert json.loads(notice_of(voided, "S").body)["data"]["simulated"] is simulated


def test_every_change_that_a_client_hears_of_has_a_name(store):
    exam = begin(store)
    for act in range(3):
        measured = measure(store, exam)
        store.save_press(
            {"id": f"p-{act}", "state": "done", "mode": "standard", "measurement_id": measured["id"], "code": None}
        )
    store.exams.void(measured["id"], version=1, by="Ada", reason="Slipped")
    assert {TYPES[change.what] for change in store.listing.changes(after=0, limit=99)} == {
        "exam.made", "measurement.taken", "measurement.voided",
    }  # fmt: skip


def test_a_secret_is_read_of_its_file(tmp_path):
    assert read_secret(write_secret(tmp_path)) == SECRET


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "24 to 64 bytes"), ("whsec_", "24 to 64 bytes"), ("whsec_c2hvcnQ=", "24 to 64 bytes"),
        (base64.b64encode(SECRET).decode(), "whsec_"), ("whsec_ä", "base64"), ("whsec_???", "base64"),
        ("whsec_" + base64.b64encode(bytes(65)).decode(), "24 to 64 bytes"),
    ],
)  # fmt: skip
def test_what_is_no_secret_is_refused(tmp_path, text, why):
    file = tmp_path / "secret"
    file.write_text(text)
    file.chmod(0o600)
    with pytest.raises(WebhookFailed, match=why):
        read_secret(file)


def test_a_secret_that_is_missing_or_that_everybody_may_read_is_refused(tmp_path):
    with pytest.raises(WebhookFailed, match="No such file"):
        read_secret(tmp_path / "none")
    file = write_secret(tmp_path)
    file.chmod(0o644)
    with pytest.raises(WebhookFailed, match="Everybody may read"):
        read_secret(file)


def test_whatever_act_names_a_measurement_is_one_with_a_name_or_told_to_nobody(store):
    measured = measure(store, begin(store))
    with store._transaction() as db:
        for what in get_args(AuditedAct):
            if not what.startswith("exam_"):
                append(db, what, measured["id"], after={"measurement_id": measured["id"]})
    told = [change.what for change in store.listing.changes(after=0, limit=99)]
    assert set(told) == {"exam_made", "measurement_moved", "measurement_voided", "press_ended"}
    assert set(told) <= set(TYPES)


def test_a_recording_that_a_rule_deleted_is_no_change_of_its_measurement(store):
    measured = measure(store, begin(store))
    [gone] = store.retention.carry_out(RetentionRule(free_mb=1e9, saved_first=False)).removals
    assert gone.measurement_id == measured["id"]
    assert [change.what for change in store.listing.changes(after=0, limit=99)] == ["exam_made"]
