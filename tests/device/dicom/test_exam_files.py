"""What is written of an exam, judged by dciodvfy: images with a scale, and reports of numbers."""

import csv
import io
import re
import subprocess
import sys
import time
import zipfile
from decimal import Decimal

import numpy as np
import pydicom
import pytest
from shown_intervals import SHOWN
from written_exam import CAMERA, ESTIMATE, OF_A_PATIENT, begin, measure, needs_dciodvfy, quantity, verdict

from device.config import DicomSection
from device.dicom import codes, outgoing
from device.dicom.hospital import Hospital
from device.dicom.image import COMMENT_LENGTH, MARGIN_PX, ROW_PX
from device.dicom.subject import DicomSubject, OrderedStudy, study_uid
from device.dicom.wording import rows
from device.errors import DeletedRecording, InvalidRequest, UnknownResource
from device.files.recording_file import RecordingHead, read_picture
from device.records import exams
from device.records.retention import RetentionRule

WITHOUT_ANYTHING = {**dict.fromkeys(("order_number", "side", "clock_position", "nipple_distance_mm")), "note": ""}
NOTHING = {**ESTIMATE, **{name: quantity(None, None, None) for name in ("size_mm", "depth_mm", "youngs_modulus_kpa")}}

UNDETERMINED = {**ESTIMATE, **dict.fromkeys(("size_mm", "depth_mm"), ESTIMATE["youngs_modulus_kpa"])}


@pytest.fixture
def hospital(store):
    return Hospital(DicomSection(institution="Klinik Süd"), store, read_picture)


@pytest.fixture
def files_of(hospital, tmp_path):
    def files(exam):
        folder = tmp_path / "written"
        with zipfile.ZipFile(io.BytesIO(hospital.files_of(exam["id"]))) as archive:
            archive.extractall(folder)
            return {name.split("-")[0]: folder / name for name in archive.namelist()}

    return files


def test_what_is_written_twice_is_the_same_to_the_last_bit(store, hospital):
    exam = begin(store)
    measure(store, exam)
    first = hospital.files_of(exam["id"])
    time.sleep(0.01)  # an object knows its time to a millisecond
    again = hospital.files_of(exam["id"])
    contents = [
        {name: archive.read(name) for name in archive.namelist()}
        for archive in (zipfile.ZipFile(io.BytesIO(one)) for one in (first, again))
    ]
    assert len(contents[0]) == 2
    assert contents[0] == contents[1]
    for content in contents[0].values():
        assert pydicom.dcmread(io.BytesIO(content)).file_meta.ImplementationVersionName == "TSIS"


def items(data):
    """Every item of a report below another, with its concept's words."""
    for item in data.get("ContentSequence", ()):
        concept = item.ConceptNameCodeSequence[0].CodeMeaning if "ConceptNameCodeSequence" in item else ""
        yield concept, item
        yield from items(item)


def numbers(report):
    """Concept, value, unit by UCUM and interval of each number of the measurement group."""
    found = {}
    for concept, item in items(report):
        if item.ValueType == "NUM" and item.RelationshipType == "CONTAINS":
            measured = [*item.MeasuredValueSequence]
            unit = measured[0].MeasurementUnitsCodeSequence[0] if measured else None
            below = {name: float(one.MeasuredValueSequence[0].NumericValue) for name, one in items(item)
                     if one.ValueType == "NUM"}  # fmt: skip
            found[concept] = (float(measured[0].NumericValue), unit.CodeValue, below) if measured else None
            assert unit is None or unit.CodingSchemeDesignator == "UCUM"
    return found


@needs_dciodvfy
@pytest.mark.parametrize("said", [{}, WITHOUT_ANYTHING, {"kind": "phantom"}], ids=["all", "nothing", "phantom"])
@pytest.mark.parametrize("estimate", [ESTIMATE, NOTHING], ids=["numbers", "no numbers"])
@pytest.mark.parametrize("simulated", [False, True], ids=["real", "simulated"])
def test_dciodvfy_finds_nothing_but_what_is_known(store, files_of, said, estimate, simulated):
    exam = begin(store, **said)
    measure(store, exam, estimate=estimate, simulated=simulated, warnings=[{"title": "T", "cause": "C."}])
    assert {kind: verdict(path) for kind, path in files_of(exam).items()} == {"image": [], "report": []}


@needs_dciodvfy
def test_dciodvfy_would_tell_of_an_object_that_lacks_something(store, files_of):
    exam = begin(store)
    measure(store, exam)
    for path in files_of(exam).values():
        data = pydicom.dcmread(path)
        del data.StudyInstanceUID
        data.save_as(path)
        assert any("StudyInstanceUID" in line for line in verdict(path))


def test_the_report_has_value_unit_and_interval_of_what_is_determined_and_nothing_of_what_is_not(store, files_of):
    exam = begin(store)
    measure(store, exam)
    report = pydicom.dcmread(files_of(exam)["report"])
    above, below = codes.ABOVE.meaning, codes.BELOW.meaning
    found = numbers(report)
    value, unit, interval = found["Diameter"]
    assert (value, unit) == (9.8, "mm")
    assert interval == pytest.approx({above: 0.8, below: 0.7, codes.INTERVAL_LEVEL.meaning: 90.0})
    depth, unit, interval = found[codes.TOP_DEPTH.meaning]
    assert (depth, unit) == (6.0, "mm")
    assert interval == pytest.approx({below: 0.5, codes.INTERVAL_LEVEL.meaning: 90.0}), "its upper end is open"
    assert found["Elasticity"] is None
    assert found["Distance from nipple"][:2] == (35.0, "mm")
    [unknown] = [item for concept, item in items(report) if concept == "Elasticity"]
    assert unknown.NumericValueQualifierCodeSequence[0].CodeMeaning == "Value indeterminate"
    [open_end] = [item for concept, item in items(report) if concept == codes.OPEN_END.meaning]
    assert open_end.ConceptCodeSequence[0].CodeValue == "HIGH-END"
    said = [item.TextValue for concept, item in items(report) if concept == "Comment"]
    assert said == [
        "Depth of top: 6.0 mm (90 %: 5.5 mm or more)", ESTIMATE["reason"], OF_A_PATIENT["note"],
        "Documents size, depth and modulus. Not a diagnosis.",
    ]  # fmt: skip


@needs_dciodvfy
@pytest.mark.parametrize(
    ("kind", "estimate", "finding"),
    [
        ("patient", ESTIMATE, ["Lesion"]), ("phantom", ESTIMATE, ["Inclusion in a phantom"]),
        ("patient", NOTHING, []), ("phantom", NOTHING, []), ("patient", UNDETERMINED, []),
    ],
)  # fmt: skip
def test_a_report_without_any_number_has_no_finding(store, files_of, kind, estimate, finding):
    """A press that found nothing, or was refused, is no lesion to a program that reads codes; where it was stays."""
    exam = begin(store, kind=kind)
    measure(store, exam, estimate=estimate)
    path = files_of(exam)["report"]
    coded = [(concept, item.ConceptCodeSequence[0].CodeMeaning) for concept, item in items(pydicom.dcmread(path))
             if item.ValueType == "CODE"]  # fmt: skip
    assert [value for concept, value in coded if concept == "Finding"] == finding
    assert ("Finding Site", "Phantom" if kind == "phantom" else "Breast") in coded
    assert verdict(path) == []


@pytest.mark.parametrize(("low", "value", "high", "shown"), SHOWN)
def test_value_and_ranges_of_the_report_have_the_digits_of_the_interval_and_hold_it(
    store, files_of, low, value, high, shown
):
    exam = begin(store)
    measure(store, exam, estimate={**ESTIMATE, "size_mm": quantity(value, low, high)})
    report = pydicom.dcmread(files_of(exam)["report"])
    [size] = [item for concept, item in items(report) if concept == "Diameter"]
    told = {concept: item.MeasuredValueSequence[0]["NumericValue"].value for concept, item in items(size)
            if item.ValueType == "NUM"}  # fmt: skip
    written = size.MeasuredValueSequence[0]["NumericValue"].value
    above, below = told[codes.ABOVE.meaning], told[codes.BELOW.meaning]
    assert str(written) == shown[0]
    assert Decimal(str(written)) - Decimal(str(below)) == Decimal(shown[1])
    assert Decimal(str(written)) + Decimal(str(above)) == Decimal(shown[2])


@pytest.mark.parametrize("ends", [("low_is_open",), ("high_is_open",), ("low_is_open", "high_is_open")])
@needs_dciodvfy
def test_an_open_end_has_no_range_of_uncertainty_in_the_report(store, files_of, ends):
    exam = begin(store)
    measure(store, exam, estimate={**ESTIMATE, "size_mm": quantity(9.8, 9.1, 10.6, **dict.fromkeys(ends, True))})
    path = files_of(exam)["report"]
    _, _, interval = numbers(pydicom.dcmread(path))["Diameter"]
    closed = {"low_is_open": codes.BELOW.meaning, "high_is_open": codes.ABOVE.meaning}
    assert interval.keys() == {codes.INTERVAL_LEVEL.meaning, *(side for end, side in closed.items() if end not in ends)}
    assert verdict(path) == []


def test_both_objects_say_whose_they_are_and_who_took_them(store, files_of):
    exam = begin(store)
    measurement = measure(store, exam)
    image, report = (pydicom.dcmread(files_of(exam)[kind]) for kind in ("image", "report"))
    for data in (image, report):
        told = (data.PatientID, data.AccessionNumber, data.InstitutionName, data.DeviceSerialNumber, data.PatientName)
        assert told == ("Ä-17", "2026/1", "Klinik Süd", "TSIS-0042", "")
        assert data.InstanceNumber == measurement["seq"]
        assert "QualityControlSubject" not in data
    assert image.StudyInstanceUID == report.StudyInstanceUID
    assert (image.ImageLaterality, image.OperatorsName) == ("L", "Ada Byron^")
    where = {concept: item.ConceptCodeSequence[0] for concept, item in items(report) if item.ValueType == "CODE"}
    assert where["Laterality"].CodeMeaning == "Left"
    assert where["Topographical modifier"].CodeValue == "129781005"
    assert where["Finding"].CodeMeaning == "Lesion"


def test_all_times_of_an_object_have_the_one_offset_that_it_names(store, files_of, monkeypatch):
    monkeypatch.setattr(exams, "utc_now", lambda: "2026-10-24T22:30:00.000Z")
    monkeypatch.setenv("TZ", "Europe/Berlin")
    time.tzset()
    try:
        exam = begin(store)
        measure(store, exam, taken_at="2026-10-25T10:00:00.000Z")  # after the clocks were put back
        for path in files_of(exam).values():
            data = pydicom.dcmread(path)
            assert data.TimezoneOffsetFromUTC == "+0200"
            assert (data.StudyDate, data.StudyTime[:6]) == ("20261025", "003000")
            for what in ("InstanceCreation", "Content", "Acquisition"):
                if f"{what}Date" in data and data.Modality == "OT":
                    assert (data[f"{what}Date"].value, data[f"{what}Time"].value[:6]) == ("20261025", "120000")
    finally:
        monkeypatch.undo()
        time.tzset()


def test_the_image_is_the_kept_picture_with_its_scale_and_rows_below(store, files_of):
    exam = begin(store)
    measure(store, exam)
    image = pydicom.dcmread(files_of(exam)["image"])
    assert [float(one) for one in image.PixelSpacing] == pytest.approx([64 * 0.05 / 240] * 2, rel=0.05)
    pixels = image.pixel_array
    assert (pixels[:240, :240] == np.arange(240)[:, None]).all()
    assert pixels[240:].max() > 200  # the rows of text
    said = "Size: 9.8 mm (90 %: 9.1 to 10.6 mm); Depth of top: 6.0 mm (90 %: 5.5 mm or more)"
    assert said in image.ImageComments
    assert "Young's modulus: not determined" in image.ImageComments


@needs_dciodvfy
def test_reason_and_warnings_are_in_the_images_comment_and_no_row_below_it_is_cut(store, files_of):
    exam = begin(store)
    warnings = [{"title": "Camera dropped frames", "cause": f"It lost {number} of 9." * 99} for number in range(9)]
    measure(store, exam, estimate={**NOTHING, "reason": "Not round: press again. " * 9}, warnings=warnings)
    path = files_of(exam)["image"]
    image = pydicom.dcmread(path)
    assert verdict(path) == []
    assert "\r\nNot round: press again." in image.ImageComments
    assert "\r\nCamera dropped frames: It lost 0 of 9." in image.ImageComments
    assert len(image.ImageComments) <= COMMENT_LENGTH
    pixels = image.pixel_array
    text = rows(store.measurement("00000000-0000-4000-8000-000000000001"), simulated=False, phantom=False)
    assert len(text) == 3 + 4 + 9 + 1
    assert pixels.shape[0] == 240 + ROW_PX * len(text) + MARGIN_PX
    below, rim = pixels[240:], MARGIN_PX - 2
    for row in range(len(text)):
        assert below[ROW_PX * row + 6 : ROW_PX * (row + 1)].max() > 200, f"row {row} is empty"
    assert not below[:, -rim:].any(), "a row reaches the right rim"
    assert not below[-4:].any(), "a row reaches the lower rim"


@pytest.mark.parametrize(
    ("ramps", "frames"),
    [({}, "frames, 0"), ({"ramps": 1}, "frames, 0"), ({"ramps": 3}, "frames of the scan's first press on the lesion")],
)
def test_the_image_of_a_scan_says_that_it_is_of_its_first_press(store, files_of, ramps, frames):
    exam = begin(store)
    measure(store, exam, **ramps)
    said = pydicom.dcmread(files_of(exam)["image"]).DerivationDescription
    assert said.startswith(f"Mean contrast of the pressed {frames}")


def test_phantoms_and_simulated_presses_are_marked_as_no_patients(store, files_of):
    phantom = begin(store, kind="phantom")
    measure(store, phantom)
    of_phantom = pydicom.dcmread(files_of(phantom)["image"])
    assert (of_phantom.QualityControlSubject, of_phantom.PatientID) == ("YES", f"PHANTOM-{phantom['id']}")
    patient = begin(store)
    measure(store, patient, simulated=True)
    written = files_of(patient)
    simulated, report = pydicom.dcmread(written["image"]), pydicom.dcmread(written["report"])
    assert simulated.QualityControlSubject == "YES"
    assert "simulated" in simulated.SeriesDescription
    assert any("Simulated press" in item.get("TextValue", "") for _, item in items(report))


def test_a_phantom_is_one_patient_whichever_probe_pressed_it():
    """An archive that has exams of two probes makes one patient of whatever has the same number."""
    exam = {"patient_ref": None, "id": "8d1c7f5e-6a1b-4f0e-9d1e-2b3c4d5e6f70", "seq": 7, "made_at": ""}
    heads = [RecordingHead(serial, "1.0", simulated=False, camera=CAMERA) for serial in ("A", "B")]
    patients = {DicomSubject({}, of, head).patient_id for of in (exam, exam | {"id": "another"}) for head in heads}
    assert patients == {f"PHANTOM-{exam['id']}", "PHANTOM-another"}
    assert all(len(one) <= 64 for one in patients)


def test_an_exam_of_more_measurements_than_are_read_at_once_is_written_whole(store, hospital, monkeypatch):
    monkeypatch.setattr(outgoing, "AT_ONCE", 2)
    exam = begin(store)
    kept = [measure(store, exam) for _ in range(5)]
    store.exams.void(kept[2]["id"], version=1, by="Ada", reason="Slipped")
    with zipfile.ZipFile(io.BytesIO(hospital.files_of(exam["id"]))) as archive:
        assert len(archive.namelist()) == 8


def test_what_is_void_is_not_written_and_an_exam_without_anything_is_refused(store, hospital):
    exam = begin(store)
    kept, void = measure(store, exam), measure(store, exam)
    store.exams.void(void["id"], version=1, by="Ada", reason="Slipped")
    with zipfile.ZipFile(io.BytesIO(hospital.files_of(exam["id"]))) as archive:
        assert archive.namelist() == [f"image-{kept['seq']}.dcm", f"report-{kept['seq']}.dcm"]
    with pytest.raises(InvalidRequest, match="no measurement that counts"):
        hospital.files_of(begin(store)["id"])
    with pytest.raises(UnknownResource):
        hospital.files_of("nobody's")


def test_what_a_rule_has_deleted_the_recording_of_is_named_and_the_rest_is_written(store, hospital):
    exam, rule = begin(store), RetentionRule(keep_days=30, saved_first=False)
    old, new = measure(store, exam), measure(store, exam, taken_at=exams.utc_now())
    store.retention.carry_out(rule)
    with zipfile.ZipFile(io.BytesIO(hospital.files_of(exam["id"]))) as archive:
        assert archive.namelist() == [f"image-{new['seq']}.dcm", f"report-{new['seq']}.dcm", "missing.csv"]
        [head, said] = csv.reader(io.TextIOWrapper(archive.open("missing.csv"), "utf-8"))
    assert head == ["measurement_id", "why"]
    assert said[0] == old["id"]
    assert re.fullmatch(f"The recording {old['recording_id']} was deleted at .*: older than 30 days.", said[1])
    store.exams.void(new["id"], version=1, by="Ada", reason="Slipped")
    with pytest.raises(DeletedRecording, match="a rule has deleted its recordings"):
        hospital.files_of(exam["id"])


def test_an_object_is_the_same_one_until_the_exam_says_something_else(store, files_of):
    exam = begin(store)
    measure(store, exam)

    def uids():
        return {kind: pydicom.dcmread(path).SOPInstanceUID for kind, path in files_of(exam).items()}

    first = uids()
    assert uids() == first
    assert len(set(first.values())) == 2
    assert all(re.fullmatch(r"2\.25\.[1-9]\d*", uid) and len(uid) <= 64 for uid in first.values())
    store.exams.change(exam["id"], {"patient_ref": "B-18"}, version=1, by="Ada", reason="Mixed up")
    assert not set(uids().values()) & set(first.values())


@pytest.mark.parametrize(
    ("made_at", "date"), [("1970-01-01T00:02:00.000Z", "20260102"), ("2026-01-01T10:00:00.000Z", "20260101")]
)
def test_an_exam_that_was_begun_in_1970_is_of_the_day_of_its_press(store, hospital, monkeypatch, made_at, date):
    """The board's clock had no battery, and its time server answered after that."""
    monkeypatch.setattr(exams, "utc_now", lambda: made_at)
    exam = begin(store)
    for taken_at in ("1970-01-01T00:04:00.000Z", "2026-01-02T10:00:00.000Z", "2026-01-03T10:05:00.000Z")[
        made_at > "2" :
    ]:
        measure(store, exam, taken_at=taken_at)
    with zipfile.ZipFile(io.BytesIO(hospital.files_of(exam["id"]))) as archive:
        written = [pydicom.dcmread(io.BytesIO(archive.read(name))) for name in archive.namelist()]
    assert len(written) >= 4
    assert {(one.StudyDate, one.StudyTime) for one in written} == {(date, written[0].StudyTime)}


def test_a_corrected_patient_gets_a_study_of_his_own(store):
    exam, order = begin(store), OrderedStudy("2.25.77", "Ä-17", "2026/1")
    assert study_uid(exam, order) == "2.25.77"
    others = {study_uid({**exam, name: "X"}, order) for name in ("patient_ref", "order_number")}
    assert len({*others, study_uid(exam, None), "2.25.77"}) == 4


@pytest.mark.parametrize(
    ("said", "why"),
    [({"patient_ref": "A\\17"}, "backslash"), ({"order_number": "1" * 17}, "at most 16"),
     ({"order_number": "1\\2"}, "backslash")],
)  # fmt: skip
def test_an_identifier_that_dicom_cannot_hold_is_refused_and_not_cut(store, hospital, said, why):
    exam = begin(store, **said)
    measure(store, exam)
    with pytest.raises(InvalidRequest, match=why):
        hospital.files_of(exam["id"])


def test_a_name_is_no_family_name_by_guess_and_cannot_break_out_of_its_component(store, files_of):
    exam = begin(store, operator="Ada=B^C\\D")
    measure(store, exam)
    assert pydicom.dcmread(files_of(exam)["image"]).OperatorsName == "Ada B C D^"


def test_the_longest_texts_of_an_exam_are_written(store, files_of):
    exam = begin(store, operator="Ä" * 64, patient_ref="Ü" * 64, order_number="1" * 16, note="ß" * 2000)
    measure(store, exam)
    image = pydicom.dcmread(files_of(exam)["image"])
    assert image.PatientID == "Ü" * 64
    assert len(str(image.OperatorsName)) == 64


def test_every_own_term_is_short_enough_and_on_the_page(request):
    page = (request.config.rootpath / "docs" / "dicom.md").read_text(encoding="utf-8")
    for term in codes.OWN_TERMS:
        assert len(term.value) <= 16
        assert f"| `{term.value}` | {term.meaning} |" in page


def test_nothing_of_dicom_is_imported_by_who_only_serves():
    program = "import sys, device.web.app; print([m for m in sys.modules if m.startswith(('pydicom', 'pynetdicom'))])"
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"
