"""Exams of one order are one study that says one thing, of one patient; what was sent before stays as it was."""

import io
import subprocess
import zipfile
from dataclasses import asdict, replace

import pydicom
import pytest
from written_exam import measure, needs_dciodvfy, verdict

from device.dicom.exam_files import exam_zip
from device.dicom.objects import as_file
from device.dicom.subject import OrderedStudy
from device.errors import StaleVersion
from device.records import exams
from device.records.exams import exam_content

ANA = {"name": "Müller^Ana", "birth_date": "19700102", "sex": "F", "issuer": "HOSP"}
ORDER = OrderedStudy("1.2.3.4", "A-17", "2026/1", "RP-1", "SPS-1", "Palpable lesion", ANA)
ACT = {"by": "Ada", "reason": "Mixed up"}


def ordered(store, order=ORDER, *, side="left", issuer_of_exam=None, **patient):
    """Begin an exam of an order as of the worklist, some of its patient said otherwise, and measure once in it."""
    who = {"kind": "patient", "patient_ref": order.patient_ref, "order_number": order.order_number or None}
    told = asdict(order) | {"patient": {**order.patient, **patient}}
    of_patient = told.pop("patient")
    content = exam_content({**who, "operator": "Ada", "side": side})
    exam = store.exams.make(
        content, None, lambda db, exam_id: store.outbox.order(db, exam_id, told, of_patient, ""), issuer_of_exam
    )
    measure(store, exam, taken_at=exam["made_at"])
    return exam


def files(store, outgoing, *of):
    """Return each object of the outbox as the bytes that are sent, by its identifier."""
    rows = [row for exam in of for row in store.outbox.of_exam(exam["id"]) if row["state"] == "queued"]
    return {row["uid"]: as_file(outgoing.written(row)) for row in rows}


def sent(store, outgoing, exam):
    """Send an exam as it is, and return its objects, read from their bytes."""
    outgoing.queue(exam["id"], version=store.exams.exam(exam["id"])["version"], by="Ada")
    return [pydicom.dcmread(io.BytesIO(one)) for one in files(store, outgoing, exam).values()]


def of_study(objects):
    return {(one.StudyInstanceUID, one.StudyID, one.StudyDate, one.StudyTime, one.AccessionNumber) for one in objects}


def at(monkeypatch, time):
    monkeypatch.setattr(exams, "utc_now", lambda: time)


@pytest.fixture
def two(store, monkeypatch):
    """Two exams of one order, on two days."""
    at(monkeypatch, "2026-01-02T10:00:00.000Z")
    first = ordered(store)
    at(monkeypatch, "2026-01-03T11:30:00.000Z")
    return first, ordered(store, side="right")


def test_two_exams_of_one_order_say_the_same_of_their_study_whichever_is_sent_first(store, outgoing, two):
    first, second = two
    objects = sent(store, outgoing, second) + sent(store, outgoing, first)
    [(uid, study_id, date, _, number)] = of_study(objects)
    assert (uid, study_id, date, number) == ("1.2.3.4", "RP-1", "20260102", "2026/1")
    assert {one.ContentDate for one in objects} == {"20260102", "20260103"}, "each press has its own time"
    assert "own_study" not in second


@needs_dciodvfy
def test_dcentvfy_finds_nothing_that_two_exams_of_one_order_say_otherwise(store, outgoing, two, tmp_path):
    for exam in two:
        outgoing.queue(exam["id"], version=1, by="Ada")
    for number, content in enumerate(files(store, outgoing, *two).values()):
        (tmp_path / f"{number}.dcm").write_bytes(content)
    told = subprocess.run(["dcentvfy", *sorted(map(str, tmp_path.glob("*.dcm")))], capture_output=True, text=True)
    told_of_values = [line for line in told.stderr.splitlines() if "Different information entities" not in line]
    assert (told.returncode, told_of_values) == (0, []), "a number is in a report's request, too: that is no difference"


def test_files_for_a_pc_say_of_the_study_what_is_sent(store, outgoing, two):
    with zipfile.ZipFile(io.BytesIO(exam_zip(store, outgoing._writer, two[1]["id"]))) as archive:
        of_zip = {archive.read(name) for name in archive.namelist()}
    outgoing.queue(two[1]["id"], version=1, by="Ada")
    assert of_zip == set(files(store, outgoing, two[1]).values())


@pytest.mark.filterwarnings("ignore:The value length .17. exceeds:UserWarning")  # of the order itself, as it was said
@pytest.mark.parametrize("procedure_id", ["", "P" * 17, "RP\\1"])
def test_an_order_without_a_procedure_that_fits_has_the_number_of_its_first_exam(store, outgoing, procedure_id):
    order = replace(ORDER, procedure_id=procedure_id)
    first, second = ordered(store, order), ordered(store, order)
    assert {one.StudyID for one in sent(store, outgoing, second)} == {str(first["seq"])}


def test_what_a_release_before_has_sent_of_a_study_stays_and_what_follows_says_the_same(
    store, outgoing, two, monkeypatch
):
    """It had a number and a time for each exam, and kept the number in no row."""
    first, second = two
    for exam in two:
        outgoing.queue(exam["id"], version=1, by="Ada")
    for exam in two:
        change = "json_set(json_remove(record, '$.about.study_id'), '$.about.study_at', ?)"
        store._db.execute(f"UPDATE outbox SET record = {change} WHERE exam_id = ?", (exam["made_at"], exam["id"]))
    before = files(store, outgoing, *two)
    ids = {pydicom.dcmread(io.BytesIO(one)).StudyID for one in before.values()}
    assert ids == {str(first["seq"]), str(second["seq"])}
    third, late = ordered(store), measure(store, second, taken_at=second["made_at"])
    [(_, study_id, date, *_)] = of_study(sent(store, outgoing, third))
    assert (study_id, date) == (str(first["seq"]), "20260102")
    objects = sent(store, outgoing, second)
    assert {one.StudyID for one in objects if one.InstanceNumber == late["seq"]} == {str(second["seq"])}
    assert before.items() <= files(store, outgoing, *two).items()


def test_an_object_is_written_again_as_it_was_when_the_studys_first_exam_is_corrected_away(store, outgoing, two):
    first, second = two
    outgoing.queue(second["id"], version=1, by="Ada")
    before = files(store, outgoing, second)
    store.exams.change(first["id"], {"patient_ref": "B-18"}, version=1, **ACT)
    outgoing.queue(second["id"], version=1, by="Ada")
    assert files(store, outgoing, second) == before
    assert {one.StudyID for one in sent(store, outgoing, store.exams.exam(first["id"]))} == {str(first["seq"])}


def test_a_patient_keeps_the_issuer_of_the_number_when_the_order_alone_is_corrected(store, outgoing):
    made = ordered(store, issuer_of_exam="HOSP")
    assert {one.IssuerOfPatientID for one in sent(store, outgoing, made)} == {"HOSP"}
    corrected = store.exams.change(made["id"], {"order_number": "2026/2"}, version=1, **ACT)
    outgoing.take_back_what_is_wrong()
    objects = sent(store, outgoing, corrected)
    assert {(one.AccessionNumber, one.get("IssuerOfPatientID")) for one in objects} == {("2026/2", "HOSP")}


def test_an_exam_that_another_client_corrects_meanwhile_is_refused(store, outgoing, monkeypatch):
    exam = ordered(store)
    ordered_with = store.outbox.ordered_with

    def corrected_first(uid):
        store.exams.change(exam["id"], {"patient_ref": "B-18"}, version=1, **ACT)
        return ordered_with(uid)

    monkeypatch.setattr(store.outbox, "ordered_with", corrected_first)
    with pytest.raises(StaleVersion):
        outgoing.queue(exam["id"], version=1, by="Ada")
    assert store.outbox.of_exam(exam["id"]) == []


OTHERS = [
    ({"patient_ref": "B-18"}, {}, "patient's number"),
    ({"order_number": "2026/2"}, {}, "order number"),
    ({}, {"issuer": "OTHER"}, "issuer of the number"),
    ({}, {"issuer": ""}, "issuer of the number"),
    ({}, {"name": "Meier^Ana"}, "patient's name"),
    ({}, {"birth_date": "19710102", "sex": "M"}, "date of birth, sex"),
]


@pytest.mark.parametrize(("order", "patient", "what"), OTHERS)
def test_an_exam_of_another_patient_or_order_gets_a_study_of_its_own_and_says_so(store, outgoing, order, patient, what):
    first = ordered(store)
    other = ordered(store, replace(ORDER, **order), **patient)
    assert other["own_study"].startswith(f"The ordered study has an exam with another {what}: ")
    assert store.exams.exam(other["id"]) == other
    [made] = store.audit.entries(subject=other["id"], before_seq=2**62, limit=9)
    assert made["after"]["own_study"] == other["own_study"]
    assert "Meier" not in str(made)
    studies = [of_study(sent(store, outgoing, exam)) for exam in (first, other)]
    [(uid, *_)], [(own_uid, own_id, *_, number)] = studies
    assert uid == "1.2.3.4" != own_uid
    assert (own_id, number) == (str(other["seq"]), {**asdict(ORDER), **order}["order_number"])


@needs_dciodvfy
@pytest.mark.parametrize(("procedure_id", "number"), [("RP-1", "2026/1"), ("", "2026/1"), ("RP-1", "")])
def test_a_study_of_its_own_names_the_order_for_who_matches_it_by_hand(store, outgoing, tmp_path, procedure_id, number):
    order = replace(ORDER, procedure_id=procedure_id, order_number=number)
    ordered(store, order)
    image, report = sent(store, outgoing, ordered(store, order, name="Meier^Ana", issuer="OTHER"))
    for data, request in (
        (image, image.RequestAttributesSequence[0]),
        (report, report.ReferencedRequestSequence[0]),
    ):
        assert (request.StudyInstanceUID, request.AccessionNumber) == ("1.2.3.4", number)
        assert request.get("RequestedProcedureID", "") == procedure_id
        assert (data.PatientName, data.IssuerOfPatientID, data.AccessionNumber) == ("Meier^Ana", "OTHER", number)
        data.save_as(tmp_path / "one.dcm")
        assert verdict(tmp_path / "one.dcm") == []


@pytest.mark.parametrize(
    "patient", [{}, {"name": ""}, {"name": "Müller^Ana^^ "}, {"birth_date": "", "sex": ""}], ids=str
)
def test_what_is_not_said_or_says_the_same_is_no_other_patient(store, patient):
    ordered(store)
    assert "own_study" not in ordered(store, **patient)


def test_once_names_are_erased_number_and_issuer_alone_tell_patients_apart(store):
    ordered(store)
    far = "9999-12-31T00:00:00.000Z"
    assert store.outbox.erase_patients(sent_before="2000", seen_before=far) == 1
    assert "own_study" not in ordered(store, name="Meier^Ana")
    assert "issuer of the number:" in ordered(store, name="Meier^Ana", issuer="OTHER")["own_study"]
    store._db.execute("UPDATE ordered_study SET patient = NULL")  # as a release before has erased it
    assert "own_study" not in ordered(store, issuer="OTHER", name="Beck^Ana")


def test_a_study_is_free_again_once_its_patient_was_corrected_away_unless_anything_was_sent(store, outgoing):
    def begun_after_a_correction(uid, *, tried):
        order = replace(ORDER, study_uid=uid)
        wrong = ordered(store, order)
        outgoing.queue(wrong["id"], version=1, by="Ada")
        for row in store.outbox.of_exam(wrong["id"]) if tried else ():
            store.outbox.note_try(row["uid"])
        store.exams.change(wrong["id"], {"patient_ref": "X-1"}, version=1, **ACT)
        outgoing.take_back_what_is_wrong()
        return wrong, ordered(store, replace(order, patient_ref="B-18"))

    assert "own_study" in begun_after_a_correction("1.2.3.5", tried=True)[1]
    wrong, other = begun_after_a_correction("1.2.3.6", tried=False)
    assert "own_study" not in other
    back = store.exams.change(wrong["id"], {"patient_ref": "A-17"}, version=2, **ACT)
    assert "another patient's number" in back["own_study"]
    [changed] = store.audit.entries(subject=wrong["id"], before_seq=2**62, limit=1)
    assert changed["after"] == {"patient_ref": "A-17", "own_study": back["own_study"]}
    [(of_back, *_)], [(of_other, *_)] = (of_study(sent(store, outgoing, exam)) for exam in (back, other))
    assert of_back != of_other == "1.2.3.6"


def test_once_apart_an_exam_stays_so_and_the_first_one_is_corrected_within_the_study(store, outgoing):
    first, other = ordered(store), ordered(store, name="Meier^Ana")
    for exam in (first, other):
        store.exams.change(exam["id"], {"note": "Again"}, version=1, **ACT)
    assert "own_study" not in store.exams.exam(first["id"])
    assert store.exams.exam(other["id"])["own_study"] == other["own_study"]
    [(apart, *_)], [(shared, *_)] = (of_study(sent(store, outgoing, exam)) for exam in (other, first))
    assert apart != shared == "1.2.3.4"
