"""What a real worklist has is shown, and becomes an exam whose objects say what was ordered, until names are erased."""

import io
import zipfile
from datetime import date

import pydicom
import pytest
from free_port import free_port
from ordered_step import ordered
from orthanc import Orthanc, needs_orthanc
from pydicom.dataset import Dataset
from written_exam import measure, needs_dciodvfy, verdict

from device.dicom.hospital import Hospital
from device.dicom.objects import as_file
from device.dicom.subject import require_writable
from device.dicom.worklist import _step
from device.errors import ArchiveUnreachable, InvalidRequest, NotSetUp, ReusedKey, StaleVersion, UnknownResource
from device.files.recording_file import read_picture
from device.records.asked_once import AskedOnce
from device.records.listing import Wanted

UNCLOSED = pytest.mark.filterwarnings("ignore:.*<socket.socket:pytest.PytestUnraisableExceptionWarning")
pytestmark = [needs_orthanc, UNCLOSED]
SAID = {"operator": "Ada", "side": "left"}


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    running = Orthanc(tmp_path_factory.mktemp("worklist")).start()
    ordered(running.worklists, "ana")
    bo = {"PatientID": "B-18", "PatientName": "Jäger^Bo", "AccessionNumber": "2", "StudyInstanceUID": "1.2.3.5"}
    ordered(running.worklists, "latin", charset="ISO_IR 100", day="20261124", status="ARRIVED", **bo)
    ordered(running.worklists, "wild", PatientID="A*", AccessionNumber="3", StudyInstanceUID="1.2.3.6", day="20261125")
    ordered(running.worklists, "other", station="OTHER", PatientID="C-19", StudyInstanceUID="1.2.3.7")
    ordered(running.worklists, "nobody", PatientID="", StudyInstanceUID="1.2.3.8")
    ordered(running.worklists, "long", PatientID="L", AccessionNumber="1", day="20261126", StudyInstanceUID="1.2.3.9")
    for number, status in enumerate(("CANCELED", "CANCELLED", "DISCONTINUED", "COMPLETED")):
        ordered(running.worklists, status, status=status, PatientID=f"N-{number}", StudyInstanceUID=f"1.2.4.{number}")
    yield running
    running.close()


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
    assert exam["patient_issuer"] == "HOSP"
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


@pytest.fixture
def dee(archive):
    """A step that a test may change or take away, as the hospital does: its day, and its file."""
    file = archive.worklists / "dee.wl"
    ordered(archive.worklists, "dee", PatientID="D-20", StudyInstanceUID="1.2.3.10", day="20261127")
    yield date(2026, 11, 27), file
    file.unlink(missing_ok=True)


def nothing_is_begun_of(step, hospital, store):
    with pytest.raises(UnknownResource, match="Ask for the worklist again"):
        hospital.begin_exam(step["id"], SAID)
    return store.exams.exams(before_seq=2**62, limit=9) == []


@pytest.mark.parametrize(
    "change",
    [{"status": "CANCELED"}, {"PatientID": "M-1"}, {"PatientName": "Other^Dee"}, {"AccessionNumber": "9"}, None],
)
def test_no_exam_is_begun_of_a_step_that_was_cancelled_merged_renamed_or_taken_away(
    archive, store, hospital, dee, change
):
    day, file = dee
    [step] = hospital.scheduled(day, None, None)
    file.unlink()
    if change:
        said = {"PatientID": "D-20", "StudyInstanceUID": "1.2.3.10", "day": "20261127", **change}
        ordered(archive.worklists, "dee", **said)
    again = hospital.scheduled(day, None, None)
    assert len(again) == (0 if change is None or "status" in change else 1)
    assert nothing_is_begun_of(step, hospital, store)
    for one in again:
        assert hospital.begin_exam(one["id"], SAID)["patient_ref"] == one["patient_ref"]


def test_a_step_of_the_morning_is_refused_in_the_afternoon_until_it_is_asked_for_again(archive, store):
    now = [1000.0]
    hospital = Hospital(archive.settings(), store, read_picture, clock=lambda: now[0])
    [step] = hospital.scheduled(None, "A-17", None)
    now[0] += 4 * 3600.0
    assert nothing_is_begun_of(step, hospital, store)
    [same] = hospital.scheduled(None, "A-17", None)
    assert hospital.begin_exam(same["id"], SAID)["patient_ref"] == "A-17"


def test_an_exam_can_be_begun_of_what_was_shown_before_the_worklist_went_down(archive, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    archive.kill()
    try:
        with pytest.raises(ArchiveUnreachable):
            hospital.scheduled(None, "A-17", None)
        assert hospital.begin_exam(step["id"], SAID)["patient_ref"] == "A-17"
    finally:
        archive.start()


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
    assert store.outbox.ordered(exam["id"])[1] == {"issuer": "HOSP"}
    assert store.exams.exam(exam["id"])["patient_issuer"] == "HOSP"  # it names no person


def test_a_recall_is_of_the_patient_of_its_object_also_once_names_are_erased(archive, store, hospital):
    """An archive with several issuers takes the same number of another issuer, or of none, for another patient."""
    for one in archive.ask("instances"):
        archive.remove(f"instances/{one}")
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    before, after = measure(store, exam), measure(store, exam)
    hospital.send(exam["id"], version=1, by="Ada")
    deliver = hospital._delivery().turn
    deliver()
    store.exams.void(before["id"], version=1, by="Ada", reason="Slipped")
    deliver()
    assert store.outbox.erase_patients(sent_before="9999", seen_before="2000") == 1
    store.exams.void(after["id"], version=1, by="Ada", reason="Slipped")
    assert deliver() is False
    arrived = [pydicom.dcmread(io.BytesIO(one)) for one in archive.files()]
    assert {(one.PatientID, one.get("IssuerOfPatientID")) for one in arrived} == {("A-17", "HOSP")}
    names = {}
    for one in arrived:
        names.setdefault(one.Modality, []).append((str(one.PatientName), one.PatientBirthDate, one.PatientSex))
    ana = ("Müller^Ana", "19700102", "F")
    assert names["OT"] == names["SR"] == [ana] * 2
    assert sorted(names["KO"]) == [("", "", "")] * 2 + [ana] * 2


def test_two_exams_of_an_order_whose_patient_was_merged_between_are_two_studies_at_the_archive(
    archive, store, hospital, dee
):
    """The archive makes a patient of each, and finds both by the accession number."""
    for one in archive.ask("instances"):
        archive.remove(f"instances/{one}")
    day, _ = dee
    begun = []
    for number in ("D-20", "D-20", "M-1"):
        ordered(archive.worklists, "dee", PatientID=number, StudyInstanceUID="1.2.3.10", day="20261127")
        [step] = hospital.scheduled(day, None, None)
        begun.append(hospital.begin_exam(step["id"], SAID))
        measure(store, begun[-1])
        hospital.send(begun[-1]["id"], version=1, by="Ada")
    assert ["own_study" in exam for exam in begun] == [False, False, True]
    assert hospital._delivery().turn() is False
    kept = [archive.ask(f"studies/{one}") for one in archive.ask("studies")]
    told = {study["PatientMainDicomTags"]["PatientID"]: study["MainDicomTags"] for study in kept}
    assert (len(kept), set(told)) == (2, {"D-20", "M-1"})
    assert (told["D-20"]["StudyInstanceUID"], told["D-20"]["StudyID"]) == ("1.2.3.10", "RP-1")
    assert (told["M-1"]["StudyInstanceUID"] == "1.2.3.10", told["M-1"]["StudyID"]) == (False, str(begun[2]["seq"]))
    assert told["D-20"]["AccessionNumber"] == told["M-1"]["AccessionNumber"] == "2026/1"


@needs_dciodvfy
def test_dciodvfy_finds_nothing_against_a_recall_without_a_name(store, hospital, tmp_path):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    void = measure(store, exam)
    hospital.send(exam["id"], version=1, by="Ada")
    for row in store.outbox.of_exam(exam["id"]):
        store.outbox.note_try(row["uid"])
        store.outbox.settle(row["uid"], "confirmed")
    store.outbox.erase_patients(sent_before="9999", seen_before="2000")
    store.exams.void(void["id"], version=1, by="Ada", reason="Slipped")
    hospital._outgoing.take_back_what_is_wrong()
    notes = store.outbox.in_state("queued", limit=9)
    assert [row["about"]["kind"] for row in notes] == ["rejection"] * 2
    for row in notes:
        (tmp_path / "one.dcm").write_bytes(as_file(hospital._outgoing.written(row)))
        assert verdict(tmp_path / "one.dcm") == []


def another(hospital, exam, **said):
    return hospital.begin_another(exam["id"], {"operator": "Bo", **said}, version=exam["version"])


def test_another_place_of_an_ordered_exam_is_of_its_order_also_after_a_restart(archive, store, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    restarted = Hospital(archive.settings(), store, read_picture)  # which has shown no step yet
    made = another(restarted, exam, side="right", clock_position=2)
    same = ("kind", "patient_ref", "patient_issuer", "order_number")
    assert [made[name] for name in same] == [exam[name] for name in same]
    assert (made["side"], made["clock_position"], made["operator"]) == ("right", 2, "Bo")
    assert store.outbox.ordered(made["id"]) == store.outbox.ordered(exam["id"])
    measure(store, made)
    for data in written(restarted, made):
        assert (data.StudyInstanceUID, data.PatientName, data.IssuerOfPatientID) == ("1.2.3.4", "Müller^Ana", "HOSP")
    third = another(restarted, made)
    assert store.outbox.scheduled_at(third["id"]) == "20261123101500"


def test_another_place_keeps_no_name_that_was_erased(store, hospital):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    assert store.outbox.erase_patients(sent_before="2000", seen_before="9999-12-31T00:00:00.000Z") == 1
    made = another(hospital, exam)
    assert (store.outbox.ordered(made["id"])[1], made["patient_issuer"]) == ({"issuer": "HOSP"}, "HOSP")
    assert store.outbox.erase_patients(sent_before="2000", seen_before="9999-12-31T00:00:00.000Z") == 0


def test_another_place_is_refused_once_the_order_was_seen_to_be_gone_or_the_exam_was_changed(store, hospital, dee):
    day, file = dee
    [step] = hospital.scheduled(day, None, None)
    exam = hospital.begin_exam(step["id"], SAID)
    file.unlink()
    another(hospital, exam)  # nobody has asked since
    assert hospital.scheduled(day, None, None) == []
    with pytest.raises(UnknownResource, match="has the order .* no longer.*Ask for the worklist again"):
        another(hospital, exam)
    changed = store.exams.change(exam["id"], {"patient_ref": "B-1"}, version=1, by="Ada", reason="Mixed up")
    with pytest.raises(StaleVersion):
        another(hospital, exam)
    made = another(hospital, changed)  # it is of no order any more
    assert (made["patient_ref"], made["patient_issuer"], store.outbox.ordered(made["id"])) == ("B-1", None, None)


def test_one_number_of_two_issuers_is_two_patients(archive, store, hospital):
    """As of a hospital that has merged with another."""
    other = {"AccessionNumber": "77", "StudyInstanceUID": "1.2.3.77", "IssuerOfPatientID": "OTHER"}
    ordered(archive.worklists, "merged", day="20261128", **other)
    try:
        steps = hospital.scheduled(None, "A-17", None)
    finally:
        (archive.worklists / "merged.wl").unlink()
    assert {one["patient_issuer"] for one in steps} == {"HOSP", "OTHER"}
    for one in steps:
        exam = hospital.begin_exam(one["id"], SAID)
        found = store.listing.exams(
            Wanted(), kind="patient", patient_ref="A-17", patient_issuer=one["patient_issuer"], limit=9
        )
        assert found.records == [exam]


AHEAD, NOW, LATER = (f"{year}-11-30T02:00:00.000Z" for year in (2036, 2026, 2027))


@pytest.mark.parametrize("is_confirmed", [False, True])
def test_a_name_first_seen_while_the_clock_was_years_ahead_does_not_stay_for_these_years(
    store, hospital, monkeypatch, is_confirmed
):
    [step] = hospital.scheduled(None, "A-17", None)
    exam = hospital.begin_exam(step["id"], SAID)
    measure(store, exam)
    monkeypatch.setattr("device.records.outbox.utc_now", lambda: AHEAD)
    if is_confirmed:
        hospital.send(exam["id"], version=1, by="Ada")
        for row in store.outbox.of_exam(exam["id"]):
            store.outbox.settle(row["uid"], "confirmed")
    before = {"sent_before": "2000", "seen_before": "2000"}
    assert store.outbox.erase_patients(**before) == 0
    monkeypatch.setattr("device.records.outbox.utc_now", lambda: NOW)
    assert store.outbox.erase_patients(**before) == 0
    assert {row["confirmed_at"] for row in store.outbox.of_exam(exam["id"])} == ({NOW} if is_confirmed else set())
    asked = {"sent_before": LATER, "seen_before": "2000"} if is_confirmed else {**before, "seen_before": LATER}
    assert store.outbox.erase_patients(**asked) == 1


def test_a_time_that_has_been_stays_when_names_are_looked_at_again(store, hospital, monkeypatch):
    [step] = hospital.scheduled(None, "A-17", None)
    hospital.begin_exam(step["id"], SAID)
    for at in (NOW, LATER):
        monkeypatch.setattr("device.records.outbox.utc_now", lambda at=at: at)
        store.outbox.erase_patients(sent_before="2000", seen_before="2000")
    assert store.outbox.erase_patients(sent_before="2000", seen_before=NOW) == 1


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
