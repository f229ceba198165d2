"""Who a patient of the worklist is does not stay, whether there is an archive or not. Neither is asked here."""

import threading
from datetime import timedelta

from daemon_process import wait_for
from written_exam import OF_A_PATIENT

from device.config import DicomSection
from device.dicom import sender
from device.dicom.hospital import Hospital
from device.files.recording_file import read_picture
from device.records.exams import exam_content
from device.records.outbox import OutboxItem


def made_of_a_step(store):
    """Make an exam as one of the worklist is made."""
    outbox = store.outbox
    order = lambda db, exam_id: outbox.order(db, exam_id, {}, {"name": "Müller^Ana"}, "")  # noqa: E731
    return store.exams.make(exam_content(OF_A_PATIENT), None, order)


def names(store, *exams):
    return [store.outbox.ordered(exam["id"])[1] for exam in exams]


def test_with_a_worklist_and_no_archive_names_are_erased_in_time(store, monkeypatch):
    """One was queued when there still was an archive: nothing waits any more, and it keeps no name either."""
    kept, queued = made_of_a_step(store), made_of_a_step(store)
    store.outbox.add(queued["id"], [OutboxItem("2.25.1", queued["id"], "m-1", 1, 1, {})], by="Ada", exam_version=1)
    hospital = Hospital(DicomSection(worklist_host="127.0.0.1"), store, read_picture)
    monkeypatch.setattr(sender, "NEVER_SENT", timedelta(0))
    hospital.start()
    try:
        wait_for(lambda: names(store, kept, queued), lambda found: found == [{}, {}])
    finally:
        hospital.close()


def test_a_clock_that_is_put_right_erases_no_name_before_its_time(store, monkeypatch):
    """A board without a battery comes out of a cupboard; its time server answers after the exam was begun, and it is
    sent after the next start."""
    is_steady = threading.Event()
    hospital = Hospital(DicomSection(worklist_host="127.0.0.1"), store, read_picture, is_clock_steady=is_steady.is_set)
    begun = made_of_a_step(store)
    store._db.execute("UPDATE exam SET record = json_set(record, '$.made_at', '1970-01-01T00:00:00.000Z')")
    hospital._sender._delivered()
    is_steady.set()
    for _ in range(2):
        Hospital(DicomSection(worklist_host="127.0.0.1"), store, read_picture)._sender._delivered()
        assert names(store, begun) == [{"name": "Müller^Ana"}]
    store._db.execute("UPDATE counter SET value = '2020-01-01T00:00:00.000Z' WHERE name LIKE 'named %'")
    hospital._sender._delivered()
    assert names(store, begun) == [{}]
    assert store._db.execute("SELECT count(*) FROM counter WHERE name LIKE 'named %'").fetchone() == (0,)


def test_with_an_archive_what_waits_keeps_its_name_and_what_nobody_sends_does_not(store):
    kept, queued = made_of_a_step(store), made_of_a_step(store)
    store.outbox.add(queued["id"], [OutboxItem("2.25.1", queued["id"], "m-1", 1, 1, {})], by="Ada", exam_version=1)
    assert store.outbox.erase_patients(sent_before="2000", seen_before="9999-12-31T00:00:00.000Z") == 1
    assert names(store, kept, queued) == [{}, {"name": "Müller^Ana"}]


def test_before_their_time_names_stay(store):
    kept = made_of_a_step(store)
    assert (
        store.outbox.erase_patients(sent_before="2000", seen_before="2000-01-01T00:00:00.000Z", has_archive=False) == 0
    )
    assert names(store, kept) == [{"name": "Müller^Ana"}]


def test_the_issuer_of_a_number_stays_and_is_erased_no_second_time(store):
    """What a release before has erased whole stays as it is."""
    kept, whole = made_of_a_step(store), made_of_a_step(store)
    patient = '{"name": "Müller^Ana", "birth_date": "19700102", "sex": "F", "issuer": "HOSP"}'
    store._db.execute("UPDATE ordered_study SET patient = ? WHERE exam_id = ?", (patient, kept["id"]))
    store._db.execute("UPDATE ordered_study SET patient = NULL WHERE exam_id = ?", (whole["id"],))
    far = "9999-12-31T00:00:00.000Z"
    assert store.outbox.erase_patients(sent_before="2000", seen_before=far) == 1
    assert names(store, kept, whole) == [{"issuer": "HOSP"}, {}]
    assert store.outbox.erase_patients(sent_before="2000", seen_before=far) == 0
    assert store._db.execute("SELECT count(*) FROM counter WHERE name LIKE 'named %'").fetchone() == (0,)
