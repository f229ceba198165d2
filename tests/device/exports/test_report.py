"""The printed exam, read back by poppler: whose it is, what was measured, and that it is no diagnosis; nothing else."""

import ast
import os
import shutil
import subprocess
import sys

import cv2
import numpy as np
import pytest
from daemon_process import ROOT
from kept_measurements import ESTIMATE, keep, unknown

from device.errors import UnknownResource
from device.exports import report
from device.exports.printed_text import DEJAVU
from device.exports.report import place_of, report_of
from device.instrument.press.picture import kept_or_drawn, tactile_png
from device.records.exams import ExamContent
from device.records.store import Store

pytestmark = pytest.mark.skipif(
    not shutil.which("pdftotext") and "TSIS_REQUIRE_PEERS" not in os.environ,  # there its absence is a failure
    reason="no pdftotext on this machine: install poppler-utils to read printed pages",
)


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


@pytest.fixture
def printed(store, tmp_path):
    """Return the text of an exam's pages, and keep them as exam.pdf."""

    def printing(exam):
        path = tmp_path / "exam.pdf"
        path.write_bytes(report_of(store, exam["id"], "TSIS-0042", kept_or_drawn))
        return run("pdftotext", "-layout", str(path), "-")

    return printing


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def exam(store, **fields):
    return store.exams.make(ExamContent(**{"kind": "patient", "patient_ref": "A-17", "operator": "Ada", **fields}))


def test_it_says_how_far_presses_of_the_lesion_agree(store, recording, printed):
    made = exam(store)
    keep(store, 1, exam_id=made["id"], recording=recording)
    assert "repeatability" not in printed(made).lower()
    keep(store, 2, exam_id=made["id"], recording=recording)
    text = " ".join(printed(made).split())
    for said in ("repeatability index", "0.00", "10.2 mm", "95 % of cases"):
        assert said in text


def test_it_says_whose_it_is_and_what_was_measured(store, recording, printed):
    made = exam(store, side="left", clock_position=10, nipple_distance_mm=35.0, order_number="4711", note="One\nTwo")
    keep(store, 1, exam_id=made["id"], recording=recording, picture=tactile_png(recording))
    text = printed(made)
    for said in (
        "A-17", "4711", "left breast, 10 o'clock, 35 mm from the nipple", "Ada", "One", "Two", made["id"], "TSIS-0042",
        "10.2 mm", "9.9 to 10.5 mm", "6.4 mm", "5.9 to 6.9 mm", "51 kPa or more",
        "The press does not tell the modulus.",
        "Simulated press", "2026-03-04 ", "m-1", "1 measurement, newest first", "Page 1 of 1",
    ):  # fmt: skip
        assert said in text
    assert "81" not in text.replace(made["id"], "")  # the value of a modulus that is not determined
    assert "Not a diagnosis." in text


def test_it_says_who_has_issued_the_number_also_at_its_foot(store, printed):
    content = ExamContent(kind="patient", patient_ref="4711", operator="Ada")
    made = store.exams.make(content, issuer="HOSPITAL A")
    keep(store, 1, exam_id=made["id"])
    text = " ".join(printed(made).split())
    assert "Issued by HOSPITAL A" in text
    assert f"4711 (HOSPITAL A), exam {made['id']}" in text
    assert "Issued by" not in printed(store.exams.make(content))


def test_each_measurement_says_what_made_it_and_the_head_who_printed_it(store, printed):
    """Measurements may be another probe's, restored on this one."""
    made = exam(store)
    keep(store, 1, exam_id=made["id"], serial="TSIS-0007", software="9.8.7")
    keep(store, 2, exam_id=made["id"], serial=None, software=None)
    text = " ".join(printed(made).split())
    assert "Printed by probe TSIS-0042, software" in text
    assert f"m-1, model standard {'b2' * 6}, certificate c-1, probe TSIS-0007, software 9.8.7" in text
    assert text.count("TSIS-0042") == 1


@pytest.mark.parametrize(("reached", "times"), [(False, 1), (True, 0), (None, 0)])
def test_it_says_that_a_scan_is_not_as_sure_as_was_asked(store, printed, reached, times):
    made = exam(store)
    keep(store, 1, exam_id=made["id"], mode="precise", until={"size_mm": 0.5}, reached=reached)
    assert printed(made).count("Not as sure as asked for.") == times


def test_the_force_of_a_ramp_is_said_to_be_a_mean(store, printed):
    made = exam(store)
    keep(store, 1, exam_id=made["id"], mode="precise", force_n=0.34)
    keep(store, 2, exam_id=made["id"], mode="quick", force_n=0.5)
    text = printed(made)
    assert "Mode precise, mean 0.34 N, 10 frames" in text
    assert "Mode quick, 0.50 N, 10 frames" in text


def test_it_says_mode_by_mode_how_far_presses_agree_and_which_have_an_open_end(store, printed):
    made = exam(store)
    at_end = {**unknown(13.5, half_width=0.3), "high_is_open": True}
    for number, (mode, size_mm) in enumerate((("quick", 9.0), ("standard", 10.0), ("quick", 9.4), ("standard", 10.8))):
        estimate = {**ESTIMATE, "mode": mode, "size_mm": unknown(size_mm, half_width=0.3), "depth_mm": at_end}
        keep(store, number, exam_id=made["id"], mode=mode, estimate=estimate)
    text = " ".join(printed(made).split())
    for said in ("Size quick 2 9.20 mm 0.28 mm", "Size standard 2 10.40 mm 0.57 mm", "2 of 2 have an open end"):
        assert said in text


def test_presses_of_one_mode_by_two_models_agree_in_a_row_each(store, printed):
    made = exam(store)
    pressed = (("b2", True, 9.0), ("c3", True, 10.0), ("b2", True, 9.4), ("c3", True, 10.8), ("c3", False, 12.0))
    for number, (card, simulated, size_mm) in enumerate(pressed):
        made_by = {"mode": "paper", "model_card_sha256": card * 32, "simulated": simulated}
        estimate = {**ESTIMATE, **made_by, "size_mm": unknown(size_mm, half_width=0.3)}
        keep(store, number, exam_id=made["id"], mode="paper", estimate=estimate)
    text = " ".join(printed(made).split())
    assert "9.20 mm 0.28 mm" in text
    assert "10.40 mm 0.57 mm" in text
    assert "10.73 mm" not in text, "the mean of all of c3, simulated or not"
    assert text.count("b2" * 6) == 2 + 2, "in its rows of size and depth, beside those of its measurements"


def test_an_interval_has_the_digits_that_it_supports_and_is_never_narrower(store, printed):
    made = exam(store)
    modulus = unknown(81.234, half_width=30.3)
    keep(store, 1, exam_id=made["id"], estimate={**ESTIMATE, "size_mm": unknown(10.234, half_width=0.12)})
    keep(store, 2, exam_id=made["id"], estimate={**ESTIMATE, "youngs_modulus_kpa": modulus})
    text = printed(made)
    for said in ("10.23 mm", "10.11 to 10.36 mm", "81 kPa", "50 to 112 kPa"):
        assert said in text


def test_the_picture_is_in_it_and_the_fonts_are_too(store, recording, printed, tmp_path):
    made = exam(store)
    picture = tactile_png(recording)
    keep(store, 1, exam_id=made["id"], recording=recording, picture=picture)
    printed(made)
    run("pdfimages", "-png", str(tmp_path / "exam.pdf"), str(tmp_path / "image"))
    shown = cv2.imread(str(tmp_path / "image-000.png"))
    np.testing.assert_array_equal(shown, cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR))
    fonts = run("pdffonts", str(tmp_path / "exam.pdf")).splitlines()[2:]
    embedded = [line for line in fonts if "TrueType" in line]
    assert len(embedded) >= 2
    assert all(line.split()[-5] == "yes" for line in embedded)


def test_what_people_wrote_is_no_markup_and_loads_nothing(store, printed):
    hostile = '<img src="file:///etc/passwd"/>'
    made = exam(store, patient_ref=hostile, note="<b>bold</b> &amp; <font color='white'>hidden</font>")
    text = printed(made)
    assert hostile in text
    assert "<b>bold</b> &amp;" in text


def test_every_measurement_that_counts_is_on_a_page_and_void_ones_are_counted_only(store, recording, printed):
    made, picture = exam(store), tactile_png(recording)
    for number in range(1, 9):
        keep(store, number, exam_id=made["id"], recording=recording, picture=picture)
    keep(store, 9, recording=recording)
    store.exams.void("m-3", version=1, by="Ada", reason="Slipped")
    text = printed(made)
    pages = text.count("\f")
    shown = [number for number in range(1, 10) if f"m-{number}, model" in text]
    assert shown == [1, 2, 4, 5, 6, 7, 8]
    assert "7 measurements, newest first. Voided and not shown: 1." in text
    assert pages > 1
    for foot in ("Not a diagnosis.", "A-17, exam", f"of {pages}"):
        assert text.count(foot) == pages


@pytest.mark.parametrize(
    "note", ["\n".join(f"line {n:03}" for n in range(222)), "\u738b" * 2000], ids=["lines", "script"]
)
def test_a_note_and_warnings_of_any_length_go_on_on_the_next_page(store, recording, printed, note):
    made = exam(store, note=note)
    warnings = [{"code": f"E{n:03}", "title": "Title", "cause": "cause " * 30} for n in range(60)]
    keep(store, 1, exam_id=made["id"], recording=recording, warnings=warnings)
    text = printed(made)
    wanted = note.split("\n") if "\n" in note else []
    assert [one for one in [*wanted, *(each["code"] for each in warnings)] if one not in text] == []
    for sign in "<>":  # a code may begin on one page and end on the next
        assert text.count(sign) == note.count("\u738b")


def test_a_picture_that_is_gone_leaves_the_numbers(store, printed):
    made = exam(store)
    keep(store, 1, exam_id=made["id"])
    store.recording_path("r-1").unlink()
    text = printed(made)
    assert "No picture: The recording r-1" in text
    assert "10.2 mm" in text


def test_an_exam_of_nothing_and_one_of_a_phantom_are_printed(store, printed):
    assert "0 measurements" in printed(exam(store))
    phantom = store.exams.make(ExamContent(kind="phantom", operator="Ada"))
    text = printed(phantom)
    assert "a phantom, not a patient" in text
    assert "Patient reference" not in text


def test_of_too_many_the_page_says_how_many_it_leaves_out(store, printed, monkeypatch):
    monkeypatch.setattr(report, "MOST", 1)
    made = exam(store)
    for number in (1, 2, 3):
        keep(store, number, exam_id=made["id"])
    text = printed(made)
    assert "The 2 oldest are left out" in text
    assert "m-3, model" in text
    assert "m-2, model" not in text


def test_no_exam_is_no_page(store):
    with pytest.raises(UnknownResource):
        report_of(store, "none", "TSIS-0042", kept_or_drawn)


def drawn_on(fonts, text):
    """Return what is printed of a text on a machine with these fonts: the library registers a name only once."""
    program = "import sys, pathlib; from device.exports.printed_text import printable, register_fonts;"
    program += "register_fonts(pathlib.Path(sys.argv[1])); print(ascii(printable(sys.argv[2], 'Page')))"
    told = subprocess.run(
        [sys.executable, "-c", program, fonts, text], check=True, capture_output=True, text=True,
        env={"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    return ast.literal_eval(told.stdout)


@pytest.mark.skipif(not DEJAVU.is_dir(), reason="no fonts-dejavu-core on this machine")
def test_a_character_that_the_font_has_not_is_its_code():
    assert drawn_on(DEJAVU, "\u00c4-17 \u044f \u738b") == "\u00c4-17 \u044f <U+738B>"
    assert drawn_on(DEJAVU, "a\tb\u3000c") == "a b c"


def test_without_the_fonts_the_librarys_own_are_taken():
    assert drawn_on("/nowhere", "\u00c4-17 \u044f \u738b") == "\u00c4-17 <U+044F> <U+738B>"


def test_a_place_says_what_is_known():
    nothing = {"side": None, "clock_position": None, "nipple_distance_mm": None}
    assert place_of(nothing) == ""
    assert place_of(nothing | {"side": "right", "nipple_distance_mm": 0.0}) == "right breast, 0 mm from the nipple"
