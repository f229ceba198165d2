"""Tables: every column in its unit, nothing that a spreadsheet would run, and what pandas or a spreadsheet reads."""

import csv
import io
import re
import time
from typing import Any

import pytest
from daemon_process import ROOT
from kept_measurements import ESTIMATE, keep, taken

from device.exports.arrays import TEXTS
from device.exports.lesions import lesion_table
from device.exports.selection import Selection
from device.exports.table import LONG_COLUMNS, WIDE_COLUMNS, long_table, wide_table
from device.records.exams import ExamContent
from device.records.listing import Wanted
from device.records.store import Store


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


def rows(parts):
    """Return the table as a reader of RFC 4180 sees it."""
    text = b"".join(parts).decode("utf-8")
    assert text.endswith("\r\n")
    return list(csv.DictReader(io.StringIO(text, newline=""), strict=True))


def exam(store, **fields):
    return store.exams.make(ExamContent(**{"kind": "patient", "patient_ref": "A-17", "operator": "Ada", **fields}))


def test_a_row_is_a_measurement_with_its_exam(store):
    made = exam(store, side="left", clock_position=10, nipple_distance_mm=35.0, note='two\nlines, "quoted"')
    kept = keep(store, 1, exam_id=made["id"], warnings=[{"code": "E206"}, {"code": "E407"}])
    [row] = rows(wide_table(Selection(store)))
    assert list(row) == list(WIDE_COLUMNS)
    assert {name: row[name] for name in ("measurement_id", "seq", "taken_at_utc", "exam_id", "patient_ref")} == {
        "measurement_id": "m-1", "seq": str(kept["seq"]), "taken_at_utc": taken(1), "exam_id": made["id"],
        "patient_ref": "A-17",
    }  # fmt: skip
    assert (row["side"], row["clock_position"], row["nipple_distance_mm"]) == ("left", "10", "35.0")
    assert row["note"] == 'two\nlines, "quoted"'
    assert (float(row["size_mm"]), float(row["size_low_mm"]), float(row["size_high_mm"])) == (10.2, 10.2 - 0.3, 10.5)
    assert (row["youngs_modulus_identifiable"], row["youngs_modulus_high_is_open"]) == ("false", "true")
    assert (row["warnings"], row["true_size_mm"], row["voided_at"], row["reached"]) == ("E206 E407", "", "", "")


@pytest.mark.parametrize("form", [wide_table, long_table, lesion_table])
def test_the_lines_of_the_contracts_read_a_table_with_pandas_as_it_was_written(store, tmp_path, monkeypatch, form):
    """By itself pandas reads 0012 as 12, NA as missing, and leaves out every group without an issuer."""
    written = [("0012", "HOSPITAL A"), ("0012", None), ("NA", None), ("-18", "=B"), ("'tis", None)]
    for number, (patient_ref, issuer) in enumerate(written, 1):
        made = store.exams.make(ExamContent(kind="patient", patient_ref=patient_ref, operator="NA"), issuer=issuer)
        keep(store, number, exam_id=made["id"], software="0.10")
    (tmp_path / "tsis-measurements.csv").write_bytes(b"".join(form(Selection(store))))
    monkeypatch.chdir(tmp_path)
    said = re.search(r"```python\n(import pandas.*?)```", (ROOT / "docs/contracts.md").read_text("utf-8"), re.DOTALL)
    names: dict[str, Any] = {}
    exec(said.group(1), names)
    expected = {(patient_ref, issuer or "") for patient_ref, issuer in written}
    assert set(names["patients"].groups) == expected
    assert set(names["table"]["software"]) == {"0.10"}
    numeric = set(names["numbers"])
    assert numeric & {"size_mm", "size_mean_mm", "value"}
    assert not any(name.endswith(TEXTS) for name in numeric)
    assert all(names["table"][name].dtype.kind in "if" for name in numeric)
    assert names["table"]["patient_issuer"].dtype.kind not in "if"


def test_a_row_says_who_has_issued_the_patients_number(store):
    content = ExamContent(kind="patient", patient_ref="4711", operator="Ada")
    for number, issuer in enumerate(("HOSPITAL A", "=B", None), 1):
        keep(store, number, exam_id=store.exams.make(content, issuer=issuer)["id"])
    for form in (wide_table, long_table):
        told = {
            (row["measurement_id"], row["patient_ref"], row["patient_issuer"]) for row in rows(form(Selection(store)))
        }
        assert told == {("m-1", "4711", "HOSPITAL A"), ("m-2", "4711", "'=B"), ("m-3", "4711", "")}


def test_a_row_says_how_sure_a_press_was_to_be_and_in_which_state_it_was_exported(store):
    made = exam(store)
    kept = keep(store, 1, exam_id=made["id"], until={"depth_mm": 0.5}, within_s=20.0)
    store.exams.void(kept["id"], version=kept["version"], by="Ada", reason="Slipped")
    keep(store, 2)
    plain, asked = rows(wide_table(Selection(store, with_void=True)))
    names = [*(f"until_{name}" for name in ("size_mm", "depth_mm", "youngs_modulus_kpa")), "within_s"]
    names += ["measurement_version", "exam_changed_at"]
    assert list(asked)[-len(names) :] == names
    expected = ["", "0.5", "", "20.0", str(store.measurement("m-1")["version"]), made["changed_at"]]
    assert [asked[name] for name in names] == expected
    assert int(asked["measurement_version"]) > kept["version"]
    assert [plain[name] for name in names] == ["", "", "", "", str(store.measurement("m-2")["version"]), ""]


def test_what_has_no_number_is_empty(store):
    keep(store, 1, status="no_contact")
    [row] = rows(wide_table(Selection(store)))
    assert [row[name] for name in ("size_mm", "size_low_mm", "depth_std_mm", "patient_ref")] == [""] * 4
    assert (row["status"], row["size_identifiable"]) == ("no_contact", "false")


def test_a_modulus_that_is_not_determined_has_an_interval_and_no_value(store):
    keep(store, 1)
    [row] = rows(wide_table(Selection(store)))
    assert (row["youngs_modulus_kpa"], row["youngs_modulus_std_kpa"], row["size_std_mm"] != "") == ("", "", True)
    assert (row["youngs_modulus_low_kpa"], row["youngs_modulus_high_kpa"]) == ("51.0", "111.0")


def test_a_row_says_the_level_of_its_intervals_also_of_a_release_that_did_not_keep_it(store):
    keep(store, 1)
    keep(store, 2, estimate={**ESTIMATE, "interval_level_percent": 95.0})
    assert [row["interval_level_percent"] for row in rows(wide_table(Selection(store)))] == ["95.0", "90.0"]


def test_a_quantity_is_a_row_with_its_unit(store):
    keep(store, 1)
    table = rows(long_table(Selection(store)))
    assert list(table[0]) == list(LONG_COLUMNS)
    assert [(row["quantity"], row["unit"], row["value"], row["low"]) for row in table] == [
        ("size_mm", "mm", "10.2", str(10.2 - 0.3)), ("depth_mm", "mm", "6.4", str(6.4 - 0.5)),
        ("youngs_modulus_kpa", "kPa", "", "51.0"), ("force_n", "N", "0.5012", ""), ("contrast_0", "1", "0.26", ""),
    ]  # fmt: skip


def test_a_contrast_at_a_radius_is_no_length(store):
    keep(store, 1, features={"contrast_0.9_mm": 0.1, "total_intensity": 2.5})
    units = {row["quantity"]: row["unit"] for row in rows(long_table(Selection(store)))}
    assert (units["contrast_0.9_mm"], units["total_intensity"], units["force_n"]) == ("1", "mm2", "N")


def test_a_row_of_a_quantity_says_which_ends_are_open_and_whether_it_was_voided(store):
    open_end = {**ESTIMATE["youngs_modulus_kpa"], "high_is_open": True}
    keep(store, 1, estimate={**ESTIMATE, "youngs_modulus_kpa": open_end})
    keep(store, 2)
    store.exams.void("m-2", version=1, by="Ada", reason="Slipped")
    voided, counted = (
        [row for row in rows(long_table(Selection(store, Wanted(), with_void=True))) if row["measurement_id"] == name]
        for name in ("m-2", "m-1")
    )
    assert [row["high_is_open"] for row in counted] == ["false", "false", "true", "", ""]
    assert {row["voided_at"] for row in voided} == {store.measurement("m-2")["voided"]["at"]}
    assert {row["voided_at"] for row in counted} == {""}


def test_a_row_of_a_quantity_ends_with_what_it_is_to_be_trusted_by_as_the_wide_table_says_it(store):
    made = exam(store)
    keep(store, 1, exam_id=made["id"], warnings=[{"code": "E206"}])
    [wide] = rows(wide_table(Selection(store)))
    last = ["kind", "simulated", "warnings", "reason", "model_card_sha256", "serial", "software"]
    last += ["interval_level_percent", "patient_issuer"]
    table = rows(long_table(Selection(store)))
    assert LONG_COLUMNS[LONG_COLUMNS.index("voided_at") + 1 :][: len(last)] == tuple(last)
    assert [[row[name] for name in last] for row in table] == [[wide[name] for name in last]] * len(table)
    assert (wide["kind"], wide["simulated"], wide["warnings"]) == ("patient", "true", "E206")


@pytest.mark.parametrize(
    "text",
    ["=1+1", "+1", "-1", "@SUM(A1)", "=HYPERLINK(\"http://evil.example\";\"x\")", "-2+3+cmd|' /C calc'!A0", "=",
     "=1\n=2", "\uff1d1+1", "\uff0b1", "\uff0d1", "\uff20SUM(A1)"],
)  # fmt: skip
def test_no_cell_is_a_formula(store, text):
    """Not even one whose exam was kept with such a text."""
    made = exam(store, operator=text.split("\n")[0], note=text)
    keep(store, 1, exam_id=made["id"])
    [row] = rows(wide_table(Selection(store)))
    assert (row["operator"], row["note"]) == ("'" + text.split("\n")[0], f"'{text}")
    assert not [cell for cell in row.values() if cell.startswith(("=", "+", "-", "@"))]


def test_a_note_that_begins_with_an_empty_line_is_no_formula_either(store):
    made = exam(store, note="\n=1+1")
    keep(store, 1, exam_id=made["id"])
    assert rows(wide_table(Selection(store)))[0]["note"] == "'\n=1+1"


def test_a_negative_number_stays_one(store):
    keep(store, 1, force_n=-0.0012)
    [row] = rows(wide_table(Selection(store)))
    assert float(row["force_n"]) == -0.0012


def test_any_script_comes_through(store):
    made = exam(store, operator="Åse 王 \u05d0\u200d\u05d1")
    keep(store, 1, exam_id=made["id"])
    assert rows(wide_table(Selection(store)))[0]["operator"] == made["operator"]


def test_the_local_time_is_the_same_moment(store, monkeypatch):
    monkeypatch.setenv("TZ", "Asia/Kolkata")
    time.tzset()
    keep(store, 1)
    try:
        [row] = rows(wide_table(Selection(store)))
    finally:
        monkeypatch.undo()
        time.tzset()
    assert (row["taken_at_utc"], row["taken_at_local"]) == (taken(1), "2026-03-04T15:31:05.250+05:30")


def test_a_selection_is_newest_first_over_pages_without_what_is_void_or_came_later(store):
    for number in range(1, 60):
        keep(store, number, mode="standard" if number % 2 else "quick")
    store.exams.void("m-58", version=1, by="Ada", reason="=Slipped")
    now = Selection.of_now(store, Wanted(mode="quick"))
    keep(store, 0, mode="quick")
    for _ in range(2):
        assert [int(one.measurement["id"][2:]) for one in now] == list(range(56, 0, -2))
    table = rows(wide_table(Selection(store, Wanted(mode="quick"), with_void=True)))
    assert [(row["measurement_id"], row["voided_reason"]) for row in table[:2]] == [("m-0", ""), ("m-58", "'=Slipped")]


def test_a_program_gets_back_what_was_written_though_a_spreadsheet_takes_none_for_a_formula(store):
    written = ["-17", "'-17", "A'17"]
    for number, said in enumerate(written):
        keep(store, number, exam_id=store.exams.make(ExamContent(kind="patient", patient_ref=said, operator="A"))["id"])
    cells = [row["patient_ref"] for row in rows(wide_table(Selection(store)))][::-1]
    assert cells == ["'-17", "''-17", "A'17"]
    assert [cell.removeprefix("'") for cell in cells] == written


def test_a_table_of_nothing_is_its_header(store):
    assert b"".join(wide_table(Selection.of_now(store, Wanted()))).decode().split(",")[0] == "measurement_id"
    assert rows(long_table(Selection(store))) == []
