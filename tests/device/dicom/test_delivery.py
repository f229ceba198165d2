"""What is queued gets to a real archive, once, is confirmed there, and is taken back when it is not right any more."""

import io
from datetime import timedelta

import pydicom
import pytest
from free_port import free_port
from orthanc import Orthanc, needs_orthanc
from pynetdicom.association import Association
from written_exam import begin, measure, needs_dciodvfy, verdict

from device.config import DicomSection
from device.dicom import delivery, storing
from device.dicom.association import archive_of, echo
from device.dicom.delivery import Delivery
from device.dicom.objects import DicomWriter, as_file
from device.dicom.outgoing import Outgoing
from device.errors import ArchiveUnreachable, DeletedRecording, InvalidRequest, StaleVersion
from device.files.recording_file import read_picture
from device.records.audit import utc_now
from device.records.retention import RetentionRule

# pynetdicom leaves the socket of a connection that failed to Python, which closes it at once.
UNCLOSED = pytest.mark.filterwarnings("ignore:.*<socket.socket:pytest.PytestUnraisableExceptionWarning")
pytestmark = [needs_orthanc, UNCLOSED]
ACT = {"by": "Ada", "reason": "Mixed up"}


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    running = Orthanc(tmp_path_factory.mktemp("archive")).start()
    yield running
    running.close()


@pytest.fixture(autouse=True)
def _an_empty_archive(archive):
    for one in archive.ask("instances"):
        archive.remove(f"instances/{one}")


@pytest.fixture
def outgoing(store):
    return Outgoing(store, DicomWriter(store, read_picture, "Klinik Süd"), with_phantoms=False)


@pytest.fixture
def deliver(archive, store, outgoing):
    def delivering(**more):
        settings = archive.settings(**more)
        return Delivery(settings, archive_of(settings), store, outgoing).turn()

    return delivering


@pytest.fixture
def exam(store):
    made = begin(store)
    for _ in range(2):
        measure(store, made)
    return made


def states(store):
    return [row[0] for row in store._db.execute("SELECT state FROM outbox ORDER BY seq")]


def test_an_exam_arrives_bit_by_bit_as_it_was_written_and_is_confirmed(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    written = {row["uid"]: as_file(outgoing.written(row)) for row in store.outbox.of_exam(exam["id"])}
    assert deliver() is False
    assert states(store) == ["confirmed"] * 4
    arrived = [pydicom.dcmread(io.BytesIO(one)) for one in archive.files()]
    for data in arrived:
        sent = pydicom.dcmread(io.BytesIO(written.pop(data.SOPInstanceUID)))
        assert sent == data
    assert written == {}
    assert {data.PatientID for data in arrived} == {"Ä-17"}
    assert store.outbox.counts() == {"confirmed": 4}


def test_storage_commitment_is_asked_for_and_heard(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    assert deliver(commitment_port=archive.commitment_port) is False
    assert states(store) == ["confirmed"] * 4


def test_what_the_archive_has_lost_by_the_time_it_is_asked_is_sent_again(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    for row in store.outbox.of_exam(exam["id"]):
        store.outbox.note_try(row["uid"])
        store.outbox.settle(row["uid"], "sent")  # as if it had been there, and was lost
    assert deliver(commitment_port=archive.commitment_port) is True
    assert states(store) == ["queued"] * 4
    assert deliver(commitment_port=archive.commitment_port) is False
    assert len(archive.ask("instances")) == 4


def test_nothing_is_doubled_by_asking_twice_or_by_an_answer_that_was_lost(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    outgoing.queue(exam["id"], version=1, by="Bob")
    assert states(store) == ["confirmed"] * 4
    for row in store.outbox.of_exam(exam["id"]):
        store.outbox.settle(row["uid"], "queued")  # as if the answer had never come
    deliver()
    assert states(store) == ["confirmed"] * 4
    assert len(archive.ask("instances")) == 4
    sent = [entry for entry in store.audit.entries(subject=exam["id"], before_seq=2**62, limit=9)
            if entry["what"] == "exam_sent"]  # fmt: skip
    assert [(entry["by"], len(entry["after"]["objects"])) for entry in sent] == [("Bob", 0), ("Ada", 4)]


def test_an_archive_that_is_not_there_costs_nothing_but_time(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    with pytest.raises(ArchiveUnreachable, match=r"archive HOSPACS at 127\.0\.0\.1:\d+ cannot be reached"):
        deliver(archive_port=free_port())
    for _ in range(40):  # Orthanc closes right behind its refusal: one in nine was told as a broken connection
        with pytest.raises(ArchiveUnreachable, match="rejects STRANGER"):
            deliver(own_title="STRANGER")
    assert states(store) == ["queued"] * 4
    deliver()
    assert states(store) == ["confirmed"] * 4


def test_a_void_measurement_is_recalled_by_a_note_that_names_it(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    void = store.measurements(before_seq=2**62, limit=9)[0]
    store.exams.void(void["id"], version=1, by="Ada", reason="Slipped")
    deliver()
    assert sorted(states(store)) == ["confirmed"] * 4 + ["recalled"] * 2
    notes = [one for one in archive.kept() if one["Modality"] == "KO"]
    named = {note["CurrentRequestedProcedureEvidenceSequence"][0]["ReferencedSeriesSequence"][0][
             "ReferencedSOPSequence"][0]["ReferencedSOPInstanceUID"] for note in notes}  # fmt: skip
    recalled = {row["uid"] for row in store.outbox.in_state("recalled", limit=9)}
    assert named == recalled
    assert {note["ConceptNameCodeSequence"][0]["CodeValue"] for note in notes} == {"113037"}
    assert deliver() is False
    assert len(archive.ask("instances")) == 6


def test_a_corrected_patient_takes_all_back_and_is_sent_anew(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    store.exams.change(exam["id"], {"patient_ref": "B-18"}, version=1, **ACT)
    deliver()
    assert sorted(states(store)) == ["confirmed"] * 4 + ["recalled"] * 4
    outgoing.queue(exam["id"], version=2, by="Ada")
    deliver()
    of_studies = {}
    for one in archive.kept():
        of_studies.setdefault(one["StudyInstanceUID"], set()).add(one["PatientID"])
    assert sorted(map(tuple, of_studies.values())) == [("B-18",), ("Ä-17",)]


def test_a_correction_that_is_corrected_back_is_at_the_archive_under_new_identifiers(
    store, outgoing, deliver, archive, exam
):
    """What was recalled is so for good: an archive never takes a note back."""
    for version, side in ((1, None), (2, "right"), (3, "left"), (4, "right")):
        if side:
            store.exams.change(exam["id"], {"side": side}, version=version - 1, **ACT)
        outgoing.queue(exam["id"], version=version, by="Ada")
        deliver()
    kept = archive.kept()
    named = {item["ReferencedSOPInstanceUID"] for one in kept if one["Modality"] == "KO"
             for item in one["CurrentRequestedProcedureEvidenceSequence"][0]["ReferencedSeriesSequence"][0][
                 "ReferencedSOPSequence"]}  # fmt: skip
    valid = [one for one in kept if one["Modality"] != "KO" and one["SOPInstanceUID"] not in named]
    assert sorted(one["Modality"] for one in valid) == ["OT", "OT", "SR", "SR"]
    assert len(named) == 3 * 4
    live = [row for row in store.outbox.of_exam(exam["id"]) if row["state"] == "confirmed"]
    assert {one["SOPInstanceUID"] for one in valid} <= {row["uid"] for row in live}
    assert store.outbox.is_idle()


def test_what_was_withdrawn_is_sent_once_it_is_right_again(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    other = begin(store)
    moved = store.measurements(before_seq=2**62, limit=9)
    for one in moved:
        store.exams.move(one["id"], other["id"], version=1, **ACT)
    deliver()
    for one in moved:
        store.exams.move(one["id"], exam["id"], version=2, **ACT)
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    assert states(store) == ["confirmed"] * 4
    assert len(archive.ask("instances")) == 4


@pytest.mark.parametrize(("left", "why"), [("nothing", "no measurement that counts"), ("simulated", "Simulated")])
def test_a_note_that_was_refused_is_sent_again_with_its_exam_also_where_nothing_else_is_to_go(
    store, outgoing, deliver, archive, exam, monkeypatch, left, why
):
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    no_notes = {kind: uid for kind, uid in storing.SOP_CLASSES.items() if kind != "rejection"}
    monkeypatch.setattr(storing, "SOP_CLASSES", no_notes)
    for one in store.measurements(before_seq=2**62, limit=9):
        store.exams.void(one["id"], version=1, by="Ada", reason="Another patient")
    deliver()
    assert sorted(states(store)) == ["recalled"] * 4 + ["refused"] * 4
    monkeypatch.undo()
    if left == "simulated":
        measure(store, exam, simulated=True)
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    assert sorted(states(store)) == ["confirmed"] * 4 + ["recalled"] * 4
    assert sum(one["Modality"] == "KO" for one in archive.kept()) == 4
    with pytest.raises(InvalidRequest, match=why):
        outgoing.queue(exam["id"], version=1, by="Ada")


def test_an_archive_that_cannot_say_what_it_keeps_is_told(store, outgoing, deliver, exam, monkeypatch):
    failed = pydicom.Dataset()
    failed.Status = 0xC001
    monkeypatch.setattr(Association, "send_c_find", lambda *_: iter([(failed, None)]))
    outgoing.queue(exam["id"], version=1, by="Ada")
    with pytest.raises(ArchiveUnreachable, match="does not say what it keeps: status 0xc001"):
        deliver()
    assert states(store) == ["sent"] * 4


def test_an_archive_that_never_confirms_is_told_after_an_hour_and_until_it_does(
    store, outgoing, archive, exam, monkeypatch
):
    settings = archive.settings()
    one = Delivery(settings, archive_of(settings), store, outgoing)
    with monkeypatch.context() as silenced:
        silenced.setattr(Association, "send_c_find", lambda *_: iter([]))
        outgoing.queue(exam["id"], version=1, by="Ada")
        assert one.turn() is True
        assert one.silence is None
        silenced.setattr(delivery, "LOST_AFTER", timedelta(0))
        one.turn()
        assert "has not said for an hour that it keeps what it took, 4 objects" in one.silence.cause
        assert {row["problem"] for row in store.outbox.of_exam(exam["id"])} == {
            "The archive has not said that it keeps it."
        }
        silenced.setattr(delivery, "LOST_AFTER", timedelta(hours=1))
        one.turn()
        assert one.silence is not None  # it was sent again, and nothing is said of it yet
    assert one.turn() is False
    assert (one.silence, states(store)) == (None, ["confirmed"] * 4)


def test_what_was_never_sent_is_withdrawn_and_never_is(store, outgoing, deliver, archive, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    other = begin(store)
    for one in store.measurements(before_seq=2**62, limit=9):
        store.exams.move(one["id"], other["id"], version=1, **ACT)
    deliver()
    assert states(store) == ["withdrawn"] * 4
    assert archive.ask("instances") == []


def test_a_change_that_says_nothing_else_leaves_what_was_sent(store, outgoing, deliver, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    for version, note in ((1, "other"), (2, exam["note"])):
        store.exams.change(exam["id"], {"note": note}, version=version, **ACT)
    deliver()
    assert states(store) == ["confirmed"] * 4
    assert store.outbox.is_idle()


def test_who_is_no_patient_or_has_seen_another_version_is_refused_and_nothing_queued(store, outgoing, exam):
    phantom = begin(store, kind="phantom")
    measure(store, phantom)
    with pytest.raises(InvalidRequest, match="phantoms are not sent"):
        outgoing.queue(phantom["id"], version=1, by="Ada")
    with pytest.raises(StaleVersion):
        outgoing.queue(exam["id"], version=2, by="Ada")
    too_long = begin(store, order_number="1" * 17)
    measure(store, too_long)
    with pytest.raises(InvalidRequest, match="at most 16"):
        outgoing.queue(too_long["id"], version=1, by="Ada")
    assert states(store) == []


def test_an_exam_with_a_simulated_press_is_refused_until_that_is_void_or_they_may_be_sent(store, outgoing, exam):
    simulated = measure(store, exam, simulated=True)
    with pytest.raises(InvalidRequest, match=rf"Simulated presses are not sent; .* numbers: {simulated['seq']}\."):
        outgoing.queue(exam["id"], version=1, by="Ada")
    assert states(store) == []
    with_phantoms = Outgoing(store, DicomWriter(store, read_picture), with_phantoms=True)
    with_phantoms.queue(exam["id"], version=1, by="Ada")
    assert states(store) == ["queued"] * 6
    store.exams.void(simulated["id"], version=1, by="Ada", reason="Simulated")
    outgoing.queue(exam["id"], version=1, by="Ada")


def test_an_archive_that_does_not_take_a_kind_refuses_it_and_takes_the_others(
    store, outgoing, deliver, monkeypatch, exam
):
    outgoing.queue(exam["id"], version=1, by="Ada")
    only_images = {kind: uid for kind, uid in storing.SOP_CLASSES.items() if kind == "image"}
    monkeypatch.setattr(storing, "SOP_CLASSES", only_images)  # what is proposed; the rest has no agreement
    deliver()
    assert sorted(states(store)) == ["confirmed", "confirmed", "refused", "refused"]
    monkeypatch.undo()
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    assert states(store) == ["confirmed"] * 4


def test_an_object_whose_recording_is_gone_stops_no_other(store, outgoing, deliver, exam):
    outgoing.queue(exam["id"], version=1, by="Ada")
    store.recording_path("r-1").unlink()
    deliver()
    assert sorted(states(store)) == ["confirmed"] * 3 + ["refused"]


@needs_dciodvfy
def test_dciodvfy_finds_nothing_against_what_recalls(store, outgoing, deliver, exam, tmp_path):
    outgoing.queue(exam["id"], version=1, by="Ada")
    deliver()
    store.exams.change(exam["id"], {"patient_ref": "B-18"}, version=1, **ACT)
    outgoing.take_back_what_is_wrong()
    rows = store.outbox.in_state("queued", limit=9)
    assert [row["about"]["kind"] for row in rows] == ["rejection"] * 4
    for row in rows:
        path = tmp_path / f"{row['uid']}.dcm"
        path.write_bytes(as_file(outgoing.written(row)))
        assert verdict(path) == []


def test_an_archive_says_that_it_is_there(archive):
    settings = archive.settings()
    echo(archive_of(settings), settings)
    nobody = DicomSection(archive_host="127.0.0.1", archive_port=free_port())
    with pytest.raises(ArchiveUnreachable, match="cannot be reached"):
        echo(archive_of(nobody), nobody)


def test_a_deleted_recording_keeps_no_other_measurement_of_its_exam_from_the_archive(store, outgoing, deliver):
    exam, rule = begin(store), RetentionRule(keep_days=30, saved_first=False)
    first = measure(store, exam)
    assert outgoing.queue(exam["id"], version=1, by="Ada") == {}
    deliver()
    never_sent = measure(store, exam)
    store.retention.carry_out(rule)
    with pytest.raises(DeletedRecording):
        outgoing.queue(exam["id"], version=1, by="Ada")
    measure(store, exam, taken_at=utc_now())
    missing = outgoing.queue(exam["id"], version=1, by="Ada")
    assert list(missing) == [never_sent["id"]], "the first one is at the archive as it was sent"
    assert "was deleted at" in missing[never_sent["id"]]
    deliver()
    assert states(store) == ["confirmed"] * 4
    assert first["id"] in {row["measurement_id"] for row in store.outbox.of_exam(exam["id"])}


def test_what_was_withdrawn_before_it_was_sent_and_cannot_be_written_any_more_is_named(store, outgoing):
    exam, elsewhere = begin(store), begin(store)
    moved = measure(store, exam)
    outgoing.queue(exam["id"], version=1, by="Ada")
    store.exams.move(moved["id"], elsewhere["id"], version=1, **ACT)
    outgoing.take_back_what_is_wrong()
    assert states(store) == ["withdrawn"] * 2
    store.retention.carry_out(RetentionRule(keep_days=30, saved_first=False))
    store.exams.move(moved["id"], exam["id"], version=2, **ACT)
    with pytest.raises(DeletedRecording):
        outgoing.queue(exam["id"], version=1, by="Ada")
