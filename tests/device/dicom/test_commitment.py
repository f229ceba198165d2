"""The archive's storage commitment is heard whenever it comes: hours later, after a restart, twice."""

import re
import socket
import threading
from datetime import datetime, timedelta

import pytest
from committing_archive import FAILURES, CommittingArchive, report_of
from daemon_process import wait_for
from pynetdicom.association import Association
from written_exam import begin, measure

from device.dicom import confirmation, delivery
from device.dicom.association import COMMITMENT, STUDY_FIND, archive_of, associated
from device.dicom.delivery import Delivery
from device.dicom.hospital import Hospital
from device.errors import ArchiveUnreachable, StorageError
from device.files.recording_file import read_picture
from device.records.audit import recorded
from device.records.store import Store

pytestmark = pytest.mark.filterwarnings("ignore:.*<socket.socket:pytest.PytestUnraisableExceptionWarning")
INVALID, NO_SUCH_CLASS, NO_SUCH_OBJECT, NO_SUCH_EVENT, FAILED = 0x0115, 0x0118, 0x0112, 0x0113, 0x0110


@pytest.fixture
def archive():
    running = CommittingArchive()
    yield running
    running.close()


@pytest.fixture(autouse=True)
def _no_waiting(monkeypatch):
    monkeypatch.setattr(confirmation, "REPORT_S", 0.0)


@pytest.fixture
def one(archive, store, outgoing):
    settings = archive.settings()
    made = Delivery(settings, archive_of(settings), store, outgoing)
    yield made
    made.close()


@pytest.fixture
def exam(store, outgoing):
    made = begin(store)
    measure(store, made)
    outgoing.queue(made["id"], version=1, by="Ada")
    return made["id"]


def states(store, exam_id):
    return [row["state"] for row in store.outbox.of_exam(exam_id)]


def rows(store):
    return store._db.execute("SELECT uid, state, record FROM outbox ORDER BY seq").fetchall()


def shift(store, hours):
    """Let all transactions have been taken, and all objects sent, so many hours before they were."""
    by = timedelta(hours=hours)

    def earlier(at):
        return recorded(datetime.fromisoformat(at) - by)

    with store._transaction() as db:
        for uid, record in db.execute("SELECT uid, record FROM outbox").fetchall():
            moved = re.sub(r"\d{4}-\d\d-\d\dT[\d:.]+Z", lambda at: earlier(at[0]), record)
            db.execute("UPDATE outbox SET record = ? WHERE uid = ?", (moved, uid))


def test_a_report_that_comes_hours_later_settles_what_it_names(store, one, archive, exam):
    assert one.turn() is False
    assert states(store, exam) == ["sent"] * 2
    shift(store, 20)
    assert one.turn() is False
    assert len(archive.requests) == 1, "nothing is asked again within the day"
    assert archive.report(report_of(archive.requests[0])) == 0
    assert states(store, exam) == ["confirmed"] * 2
    assert len(archive.arrived) == 2


def test_the_port_is_open_while_a_report_is_awaited_and_no_longer(store, one, archive, exam):
    def is_open():
        with socket.socket() as tried:
            return tried.connect_ex(("127.0.0.1", archive.port)) == 0

    assert not is_open()
    one.turn()
    assert is_open()
    archive.report(report_of(archive.requests[0]))
    one.turn()
    assert not is_open()


def test_a_report_after_a_restart_is_known(tmp_path, archive, monkeypatch):
    first = Store(tmp_path / "a")
    hospital = Hospital(archive.settings(), first, read_picture)
    made = begin(first)
    measure(first, made)
    hospital.start()
    hospital.send(made["id"], version=1, by="Ada")
    wait_for(lambda: len(archive.requests), lambda number: number == 1)
    hospital.close()
    first.close()
    again = Store(tmp_path / "a")
    hospital = Hospital(archive.settings(), again, read_picture)
    hospital.start()
    try:
        assert wait_for(lambda: archive.report(report_of(archive.requests[0])), lambda status: status is not None) == 0
        assert again.outbox.counts() == {"confirmed": 2}
        assert len(archive.requests) == 1
        hospital._sender.wake()
        wait_for(lambda: archive.report(report_of(archive.requests[0])), lambda status: status is None)
    finally:
        hospital.close()
        again.close()


def test_a_report_in_the_association_of_the_request_is_heard(store, one, archive, exam, monkeypatch):
    monkeypatch.setattr(confirmation, "REPORT_S", 20.0)
    archive.reports_in_association = True
    assert one.turn() is False
    assert archive.answered_in_association.get(timeout=20) == 0
    assert states(store, exam) == ["confirmed"] * 2


def test_the_answer_to_a_report_is_sent_before_the_association_is_released(store, one, archive, exam, monkeypatch):
    monkeypatch.setattr(confirmation, "REPORT_S", 20.0)
    released, take, was_early = threading.Event(), one._commitments._take, []

    def slow(event):
        released.clear()  # of the association in which objects were sent
        answer = take(event)  # which tells `ask_for`
        was_early.append(released.wait(0.5))
        return answer

    release = Association.release

    def noted_release(association):
        if association.is_requestor:
            released.set()
        release(association)

    monkeypatch.setattr(Association, "release", noted_release)
    monkeypatch.setattr(one._commitments, "_take", slow)
    archive.reports_in_association = True
    assert one.turn() is False
    assert archive.answered_in_association.get(timeout=20) == 0
    assert was_early == [False]
    assert released.is_set()


def test_an_association_is_let_go_though_it_says_that_it_does_not_pause(archive):
    """As where a report's thread ends while pynetdicom's own pauses, and says that it does not."""
    settings = archive.settings()
    with associated(archive_of(settings), settings, [COMMITMENT]) as association:
        association._reactor_checkpoint.clear()
        wait_for(lambda: association._is_paused, bool)
        association._is_paused = False
    assert association.is_released


def test_an_association_whose_thread_has_ended_already_is_let_go(archive):
    """As where both ends release at one moment: pynetdicom's own `release` would wait for ever."""
    settings = archive.settings()
    with associated(archive_of(settings), settings, [COMMITMENT]) as association:
        association._kill = True
        association.join()
        assert association.is_established
    assert association.is_released or association.is_aborted


def test_what_is_reported_as_failed_is_sent_again_and_asked_for_at_once(store, one, archive, exam):
    one.turn()
    image, report = (row["uid"] for row in store.outbox.of_exam(exam))
    told = report_of(archive.requests[0], failed=(report,))
    assert archive.report(told, event_type=FAILURES) == 0
    assert states(store, exam) == ["confirmed", "queued"]
    [_, again] = store.outbox.of_exam(exam)
    assert (again["problem"], again["rounds"]) == ("The archive does not have it any more.", 1)
    assert archive.report(told, event_type=FAILURES) == 0, "once more changes nothing"
    assert store.outbox.of_exam(exam)[1] == again
    assert one.turn() is False
    assert (archive.arrived.count(image), archive.arrived.count(report)) == (1, 2)
    assert [one.ReferencedSOPInstanceUID for one in archive.requests[1].ReferencedSOPSequence] == [report]
    before = rows(store)
    assert archive.report(told, event_type=FAILURES) == 0, "the old transaction is over"
    assert rows(store) == before
    archive.report(report_of(archive.requests[1]))
    assert states(store, exam) == ["confirmed"] * 2


def test_after_a_day_of_silence_it_is_sent_and_asked_for_anew_and_the_old_report_still_counts(
    store, one, archive, exam
):
    one.turn()
    for number in range(2, 2 + delivery.MOST_ROUNDS):
        shift(store, 25)
        assert one.turn() is True
        assert states(store, exam) == ["queued"] * 2
        assert "has not said within a day that it keeps what it took, 2 objects" in one.silence.cause
        assert one.turn() is False
        assert (len(archive.requests), len(archive.arrived)) == (number, 2 * number)
    shift(store, 25)
    one.turn()
    assert len(archive.arrived) == 2 * (1 + delivery.MOST_ROUNDS), "then it is only asked for further on"
    assert len(archive.requests) == 2 + delivery.MOST_ROUNDS
    assert archive.report(report_of(archive.requests[0])) == 0
    assert states(store, exam) == ["confirmed"] * 2
    assert one.silence is None


def test_what_was_given_up_is_confirmed_by_a_late_report(store, outgoing, one, archive, exam):
    one.turn()
    given_up = [row["uid"] for row in store.outbox.of_exam(exam)]
    for uid in given_up:
        store.outbox.note(uid, rounds=delivery.MOST_ROUNDS)
    shift(store, 25)
    other = begin(store)
    measure(store, other)
    outgoing.queue(other["id"], version=1, by="Ada")
    one.turn()
    assert archive.report(report_of(archive.requests[1], unsaid=given_up)) == 0
    assert (states(store, exam), states(store, other["id"])) == (["sent"] * 2, ["confirmed"] * 2)
    shift(store, 25)
    one.turn()
    assert states(store, exam) == ["refused"] * 2
    assert archive.report(report_of(archive.requests[0])) == 0
    assert states(store, exam) == ["confirmed"] * 2


def begun_with(store, one):
    one.turn()
    return rows(store)


def altered(report, **said):
    for name, value in said.items():
        if value is None:
            del report[name]
        else:
            setattr(report, name, value)
    return report


@pytest.mark.parametrize(
    ("alter", "status"),
    [
        (lambda told: altered(told, TransactionUID="2.25.1"), INVALID),
        (lambda told: altered(told, TransactionUID=None), INVALID),
        (lambda told: altered(told, TransactionUID=""), INVALID),
        (lambda told: altered(told, ReferencedSOPSequence=None), INVALID),
        (lambda told: altered(told, FailedSOPSequence=told.ReferencedSOPSequence), INVALID),
        (lambda told: altered(told.ReferencedSOPSequence[0], ReferencedSOPInstanceUID="2.25.7") and told, INVALID),
        (lambda told: altered(told.ReferencedSOPSequence[0], ReferencedSOPInstanceUID=None) and told, INVALID),
        (lambda told: altered(told.ReferencedSOPSequence[0], ReferencedSOPClassUID=STUDY_FIND) and told, INVALID),
        (lambda told: altered(told.ReferencedSOPSequence[0], ReferencedSOPClassUID=None) and told, INVALID),
    ],
    ids=[
        "unknown",
        "without",
        "empty",
        "of nothing",
        "both",
        "not asked for",
        "no object",
        "another class",
        "no class",
    ],
)
def test_a_report_that_is_wrong_is_refused_and_changes_nothing(store, one, archive, exam, alter, status):
    before = begun_with(store, one)
    assert archive.report(alter(report_of(archive.requests[0]))) == status
    assert rows(store) == before
    assert archive.report(report_of(archive.requests[0])) == 0
    assert states(store, exam) == ["confirmed"] * 2


@pytest.mark.parametrize(
    ("addressed", "status"),
    [({"instance": "1.2.840.10008.1.20.1.2"}, NO_SUCH_OBJECT), ({"event_type": 3}, NO_SUCH_EVENT),
     ({"sop_class": "1.2.840.10008.5.1.1.14"}, NO_SUCH_CLASS), ({"title": "STRANGER"}, None)],
    ids=["instance", "event", "class", "title"],
)  # fmt: skip
def test_what_is_no_report_of_the_archives_commitment_is_refused(store, one, archive, exam, addressed, status):
    before = begun_with(store, one)
    assert archive.report(report_of(archive.requests[0]), **addressed) == status
    assert rows(store) == before


def test_a_report_without_any_data_is_refused(store, one, archive, exam):
    before = begun_with(store, one)
    assert archive.report(None) in (INVALID, FAILED)
    assert rows(store) == before


def test_what_cannot_be_kept_is_not_acknowledged(store, one, archive, exam, monkeypatch):
    before = begun_with(store, one)
    settle = store.outbox.settle

    def full(*said, **more):
        raise StorageError("The disk is full.", "Free it.")

    monkeypatch.setattr(store.outbox, "settle", full)
    assert archive.report(report_of(archive.requests[0])) == FAILED
    assert rows(store) == before
    monkeypatch.setattr(store.outbox, "settle", settle)
    assert archive.report(report_of(archive.requests[0])) == 0
    assert states(store, exam) == ["confirmed"] * 2


def test_a_request_that_is_refused_is_no_open_transaction(store, one, archive, exam):
    archive.takes = 0x0213
    with pytest.raises(ArchiveUnreachable, match="does not take a request for storage commitment: status 0x0213"):
        one.turn()
    assert not store.outbox.awaits_commitment()
    archive.takes = 0
    one.turn()
    assert len(archive.requests) == 2
    assert archive.report(report_of(archive.requests[1])) == 0


def test_a_recalled_object_stays_so_when_the_archive_commits_itself_to_it(store, one, archive, exam):
    one.turn()
    [made] = store.measurements(before_seq=2**62, limit=9)
    store.exams.void(made["id"], version=1, by="Ada", reason="Slipped")
    one._outgoing.take_back_what_is_wrong()
    assert archive.report(report_of(archive.requests[0])) == 0
    assert states(store, exam)[:2] == ["recalled"] * 2


def test_rows_of_before_are_asked_for(store, one, archive, exam):
    for row in store.outbox.of_exam(exam):
        store.outbox.note_try(row["uid"])
        store.outbox.settle(row["uid"], "sent")
        assert "commitments" not in row
    one.turn()
    assert archive.report(report_of(archive.requests[0])) == 0
    assert states(store, exam) == ["confirmed"] * 2


def test_transactions_of_a_clock_that_ran_ahead_are_not_waited_for(store, one, archive, exam):
    one.turn()
    shift(store, -48)
    one.turn()
    assert len(archive.requests) == 2
    assert archive.report(report_of(archive.requests[0])) == 0
    assert states(store, exam) == ["confirmed"] * 2


def test_a_port_that_is_taken_is_told_and_all_else_is_sent(store, outgoing, archive, exam):
    with socket.create_server(("0.0.0.0", archive.port)):
        settings = archive.settings()
        deaf = Delivery(settings, archive_of(settings), store, outgoing)
        with pytest.raises(ArchiveUnreachable, match=f"the port {archive.port} of its storage commitment cannot be"):
            deaf.turn()
    assert states(store, exam) == ["sent"] * 2
    assert not archive.requests


def test_what_is_known_of_transactions_is_bounded(store, one, archive, exam):
    for _ in range(40):
        one.turn()
        shift(store, 25)
        for row in store.outbox.in_state("queued", limit=9):
            store.outbox.settle(row["uid"], "sent")
    [known, _] = (row["commitments"] for row in store.outbox.of_exam(exam))
    assert len(known) == 30
    assert archive.requests[-1].TransactionUID in known
    assert archive.report(report_of(archive.requests[0])) == INVALID
