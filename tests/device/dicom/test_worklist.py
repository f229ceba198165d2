"""What a real worklist has is shown, and becomes an exam whose objects say what was ordered, until names are erased."""

import io
import zipfile
from datetime import date

import pydicom
import pytest
from ordered_step import ordered
from orthanc import Orthanc, free_port, needs_orthanc
from pydicom.dataset import Dataset
from written_exam import measure, needs_dciodvfy, verdict

from device.dicom.hospital import Hospital
from device.dicom.subject import require_writable
from device.dicom.worklist import _step
from device.errors import ArchiveUnreachable, InvalidRequest, NotSetUp, ReusedKey, UnknownResource
from device.files.recording_file import read_picture
from device.records.asked_once import AskedOnce
from device.records.store import Store

UNCLOSED = pytest.mark.filterwarnings("ignore:.*<socket.socket:pytest.PytestUnraisableExceptionWarning")
pytestmark = [needs_orthanc, UNCLOSED]
SAID = {"operator": "Ada", "side": "left"}


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    running = Orthanc(tmp_path_factory.mktemp("worklist")).start()
    ordered(running.worklists, "ana")
    bo = {"PatientID": "B-18", "PatientName": "Jäger^Bo", "AccessionNumber": "2", "StudyInstanceUID": "1.2.3.5"}
    ordered(running.worklists, "latin", charset="ISO_IR 100", day="20261124", **bo)
    ordered(running.worklists, "wild", PatientID="A*", AccessionNumber="3", StudyInstanceUID="1.2.3.6", day="20261125")
    ordered(running.worklists, "other", station="OTHER", PatientID="C-19", StudyInstanceUID="1.2.3.7")
    ordered(running.worklists, "nobody", PatientID="", StudyInstanceUID="1.2.3.8")
    ordered(running.worklists, "long", PatientID="L", AccessionNumber="1", day="20261126", StudyInstanceUID="1.2.3.9")
    yield running
    running.close()


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


@pytest.fixture
def hospital(archive, store):
    return Hospital(archive.settings(), store, read_picture)


def refs(steps):
    return [one["patient_ref"] for one in steps]


def test_the_steps_of_this_probe_are_shown_by_their_time_with_names_in_any_encoding(hospital):
    steps = hospital.scheduled(None, None, None)
    assert refs(steps) == ["A-17", "B-18", "A*", "L"]
    assert [one["patient_name"] for one in steps[:2]] == ["Müller^Ana", "Jäger^Bo"]
    first = steps[0]
    assert (first["order_number"], first["study_uid"], first["scheduled_at"]) == ("2026/1", "1.2.3.4", "20261123101500")
    assert (first["description"], first["procedure_id"]) == ("Palpable lesion", "RP-1")


def test_a_day_a_patient_and_an_order_narrow_it_to_the_letter(archive, store, hospital):
    assert refs(hospital.scheduled(date(2026, 11, 24), None, None)) == ["B-18"]
    assert refs(hospital.scheduled(None, "A*", None)) == ["A*"]  # no wildcard
    assert refs(hospital.scheduled(None, None, "2026/1")) == ["A-17"]
    assert refs(hospital.scheduled(None, "a-17", None)) == []
    of_all = Hospital(archive.settings(worklist_of_all=True), store, read_picture)
    assert "C-19" in refs(of_all.scheduled(None, None, None))


def test_an_exam_of_a_step_is_written_as_it_was_ordered(store, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    assert (exam["kind"], exam["patient_ref"], exam["order_number"], exam["side"]) == (
        "patient",
        "A-17",
        "2026/1",
        "left",
    )
    measure(store, exam)
    image, report = written(hospital, exam)
    for data in (image, report):
        assert (data.StudyInstanceUID, data.AccessionNumber, data.PatientName) == ("1.2.3.4", "2026/1", "Müller^Ana")
        assert (data.PatientBirthDate, data.PatientSex, data.IssuerOfPatientID) == ("19700102", "F", "HOSP")
    assert image.RequestAttributesSequence[0].ScheduledProcedureStepID == "SPS-ana"
    assert report.ReferencedRequestSequence[0].RequestedProcedureID == "RP-1"


@needs_dciodvfy
def test_dciodvfy_finds_nothing_against_what_was_ordered(hospital, store, tmp_path):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    measure(store, exam)
    for data in written(hospital, exam):
        data.save_as(tmp_path / "one.dcm")
        assert verdict(tmp_path / "one.dcm") == []


def written(hospital, exam):
    with zipfile.ZipFile(io.BytesIO(hospital.files_of(exam["id"]))) as archive:
        return [pydicom.dcmread(io.BytesIO(archive.read(name))) for name in archive.namelist()]


def test_a_patient_who_was_corrected_has_neither_name_nor_study_of_the_order(store, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    measure(store, exam)
    changed = store.exams.change(exam["id"], {"patient_ref": "B-18"}, version=1, by="Ada", reason="Mixed up")
    for data in written(hospital, changed):
        assert (data.PatientID, data.PatientName, data.PatientBirthDate) == ("B-18", "", "")
        assert data.StudyInstanceUID != "1.2.3.4"


def test_a_step_is_one_exam_however_often_it_is_asked_for(store, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    once = AskedOnce("k-1", "POST")
    assert hospital.begin_exam(step["id"], SAID, once) == hospital.begin_exam(step["id"], SAID, once)
    with pytest.raises(UnknownResource, match="Ask for the worklist again"):
        hospital.begin_exam("2.25.1", SAID)


def test_a_step_is_one_exam_also_when_it_is_asked_for_again_after_a_restart(archive, store, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    once = AskedOnce("k-2", "POST")
    made = hospital.begin_exam(step["id"], SAID, once)
    restarted = Hospital(archive.settings(), store, read_picture)  # which has shown no step yet
    assert restarted.begin_exam(step["id"], SAID, once) == made
    with pytest.raises(ReusedKey):
        restarted.begin_exam(step["id"], SAID, AskedOnce("k-2", "POST other"))


def test_names_are_erased_from_the_disk_once_the_archive_has_the_exam(tmp_path, store, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    measure(store, exam)
    on_disk = lambda: b"".join(path.read_bytes() for path in (tmp_path / "var").glob("tsis.sqlite*"))  # noqa: E731
    far, long_ago = "9999", "2000"
    hospital.send(exam["id"], version=1, by="Ada")
    assert store.outbox.erase_patients(sent_before=far, seen_before=far) == 0  # it waits to be sent
    for row in store.outbox.of_exam(exam["id"]):
        store.outbox.settle(row["uid"], "confirmed")
    assert store.outbox.erase_patients(sent_before=long_ago, seen_before=long_ago) == 0
    assert "Müller".encode() in on_disk() or b"M\\u00fcller" in on_disk()
    assert store.outbox.erase_patients(sent_before=far, seen_before=long_ago) == 1
    assert store.outbox.erase_patients(sent_before=far, seen_before=far) == 0
    entries = store.audit.entries(subject=exam["id"], before_seq=2**62, limit=9)
    assert [one["what"] for one in entries] == ["patient_erased", "exam_sent", "exam_made"]
    assert "ller" not in str(entries)
    assert "Müller".encode() not in on_disk()
    assert b"M\\u00fcller" not in on_disk()
    assert b"19700102" not in on_disk()
    told = {(str(data.PatientName), data.PatientBirthDate) for data in written(hospital, exam)}
    assert told == {("", "")}


def test_a_name_of_an_exam_that_nobody_sends_does_not_stay(store, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    assert store.outbox.erase_patients(sent_before="2000", seen_before="9999-12-31T00:00:00.000Z") == 1
    assert store.outbox.ordered(exam["id"])[1] == {}


def test_a_reference_with_a_backslash_is_shown_as_it_was_sent_and_no_exam_is_made_of_it():
    data = Dataset()
    data.StudyInstanceUID, data.PatientID, data.AccessionNumber = "1.2.3", "P\\Q", "AC\\D"
    order = _step(data).order
    assert (order.patient_ref, order.order_number) == ("P\\Q", "AC\\D")
    with pytest.raises(InvalidRequest, match="patient_ref of the exam has a backslash"):
        require_writable({"patient_ref": order.patient_ref, "order_number": None})


def test_a_worklist_that_is_not_there_or_refuses_is_told_as_such(archive, store):
    def asked(**more):
        return Hospital(archive.settings(**more), store, read_picture).scheduled(None, None, None)

    with pytest.raises(ArchiveUnreachable, match="worklist HOSPACS at .* cannot be reached"):
        asked(worklist_port=free_port())
    with pytest.raises(ArchiveUnreachable, match="rejects STRANGER"):
        asked(own_title="STRANGER")
    with pytest.raises(NotSetUp, match="No worklist is set"):
        asked(worklist_host=None)


def test_what_dicom_cannot_ask_for_is_refused(hospital):
    with pytest.raises(InvalidRequest, match="backslash"):
        hospital.scheduled(None, "A\\17", None)
