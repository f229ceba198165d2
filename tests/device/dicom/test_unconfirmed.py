"""What an archive took and does not find keeps no other from being confirmed, and is not sent again without end."""

from datetime import timedelta

import pytest
from written_exam import begin, measure

from device.dicom import delivery
from device.dicom.association import archive_of
from device.dicom.delivery import Delivery
from device.dicom.hospital import Hospital
from device.files.recording_file import read_picture
from device.records.retention import RetentionRule

pytestmark = pytest.mark.filterwarnings("ignore:.*<socket.socket:pytest.PytestUnraisableExceptionWarning")


@pytest.fixture
def one(archive, store, outgoing):
    settings = archive.settings()
    return Delivery(settings, archive_of(settings), store, outgoing)


def sent(store, outgoing):
    """Queue an exam of one measurement; return its identifier and those of its objects."""
    exam = begin(store)
    measure(store, exam)
    outgoing.queue(exam["id"], version=1, by="Ada")
    return exam["id"], {row["uid"] for row in store.outbox.of_exam(exam["id"])}


def states(store, exam_id):
    return [row["state"] for row in store.outbox.of_exam(exam_id)]


def test_what_is_never_found_keeps_none_behind_it_from_being_asked_for(store, outgoing, one, archive, monkeypatch):
    monkeypatch.setattr(delivery, "AT_ONCE", 2)
    quarantined, archive.hidden = sent(store, outgoing)
    assert one.turn() is True
    newer, _ = sent(store, outgoing)
    one.turn()
    assert states(store, newer) == ["confirmed"] * 2
    archive.asked.clear()
    one.turn()
    assert {uid for uids in archive.asked for uid in uids} == archive.hidden, "its turn comes again"
    assert states(store, quarantined) == ["sent"] * 2


def test_what_is_never_found_while_others_are_is_sent_a_few_times_and_then_refused(
    store, outgoing, one, archive, monkeypatch
):
    monkeypatch.setattr(delivery, "LOST_AFTER", timedelta(0))
    quarantined, archive.hidden = sent(store, outgoing)
    for _ in range(delivery.MOST_ROUNDS + 3):
        sent(store, outgoing)
        one.turn()
    assert states(store, quarantined) == ["refused"] * 2
    assert store.outbox.counts() == {"refused": 2, "confirmed": 2 * (delivery.MOST_ROUNDS + 3)}
    assert {archive.arrived.count(uid) for uid in archive.hidden} == {1 + delivery.MOST_ROUNDS}
    assert {row["problem"] for row in store.outbox.of_exam(quarantined)} == {
        "The archive has not said that it keeps it, after it took it 4 times: look for it there, as among what waits "
        "to be sorted in."
    }
    removals = store.retention.plan(RetentionRule(keep_days=1, saved_first=False)).removals
    assert len(removals) == delivery.MOST_ROUNDS + 3
    assert "r-1" not in {removal.recording_id for removal in removals}
    archive.hidden = set()
    outgoing.queue(quarantined, version=1, by="Ada")
    assert one.turn() is False
    assert states(store, quarantined) == ["confirmed"] * 2


def test_an_archive_that_finds_nothing_at_all_is_asked_further_on_and_gets_nothing_without_end(
    store, outgoing, one, archive, monkeypatch
):
    exam, archive.hidden = sent(store, outgoing)
    monkeypatch.setattr(delivery, "LOST_AFTER", timedelta(0))
    for _ in range(delivery.MOST_ROUNDS + 4):
        assert one.turn() is True
    assert states(store, exam) == ["sent"] * 2
    assert len(archive.arrived) == 2 * (1 + delivery.MOST_ROUNDS)
    assert "has not said for an hour that it keeps what it took, 2 objects" in one.silence.cause
    assert {row["problem"] for row in store.outbox.of_exam(exam)} == {
        "The archive has not said that it keeps it, after it took it 4 times."
    }
    archive.hidden = set()
    assert one.turn() is False
    assert states(store, exam) == ["confirmed"] * 2
    assert one.silence is None


def test_what_is_counted_of_an_object_is_no_part_of_what_is_told(store, outgoing, one, archive):
    exam, archive.hidden = sent(store, outgoing)
    one.turn()
    told = Hospital(archive.settings(), store, read_picture).objects_of(exam)
    assert {tuple(sorted(row)) for row in told} == {(
        "confirmed_at", "exam_id", "kind", "measurement_id", "problem", "queued_at", "sent_at", "state", "study_uid",
        "tries", "uid",
    )}  # fmt: skip
