"""A row a lesion: its exam, how many presses count, and how far they agree."""

import csv
import io

import pytest
from kept_measurements import ESTIMATE, keep, taken, unknown

from device.exports.lesions import LESION_COLUMNS, lesion_table
from device.exports.selection import Selection
from device.measurement.repeats import repeats_of
from device.records.exams import ExamContent
from device.records.listing import Wanted
from device.records.store import Store


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


def rows(parts):
    return list(csv.DictReader(io.StringIO(b"".join(parts).decode(), newline=""), strict=True))


def exam(store, **fields):
    return store.exams.make(ExamContent(**{"kind": "patient", "patient_ref": "A-17", "operator": "Ada", **fields}))


def pressed(store, number, size_mm, **said):
    return keep(store, number, estimate={**ESTIMATE, "size_mm": unknown(size_mm, half_width=0.3)}, **said)


def test_presses_of_one_lesion_are_one_row(store):
    left = store.exams.make(
        ExamContent(kind="patient", patient_ref="A-17", operator="Ada", side="left", clock_position=10), issuer="HOSP"
    )
    right = exam(store, side="right")
    for number, size_mm in enumerate((9.0, 10.0, 11.5), 1):
        pressed(store, number, size_mm, exam_id=left["id"])
    pressed(store, 4, 7.0, exam_id=right["id"])
    pressed(store, 5, 99.0)
    other, one = rows(lesion_table(Selection(store)))
    assert list(one) == list(LESION_COLUMNS)
    assert (one["exam_id"], one["patient_ref"], one["side"], one["clock_position"]) == (
        left["id"],
        "A-17",
        "left",
        "10",
    )
    assert (one["patient_issuer"], other["patient_issuer"]) == ("HOSP", "")
    assert (one["measurements"], one["modes"], one["simulated"]) == ("3", "standard", "true")
    assert (one["first_taken_at_utc"], one["last_taken_at_utc"]) == (taken(1), taken(3))
    agreed = repeats_of([9.0, 10.0, 11.5])
    columns = ("size_mean_mm", "size_spread_mm", "size_repeatability_index")
    assert [float(one[name]) for name in columns] == pytest.approx(
        [agreed.mean, agreed.spread, agreed.repeatability_index]
    )
    assert (one["size_presses"], one["youngs_modulus_presses"], one["youngs_modulus_mean_kpa"]) == ("3", "0", "")
    assert (other["exam_id"], other["size_presses"], other["size_spread_mm"]) == (right["id"], "1", "")


def test_presses_of_one_lesion_in_several_modes_have_no_mean(store):
    made = exam(store)
    for number, mode in enumerate(("quick", "standard"), 1):
        estimate = {**ESTIMATE, "size_mm": unknown(9.0 + number, half_width=0.3), "mode": mode}
        keep(store, number, estimate=estimate, exam_id=made["id"], mode=mode)
    [row] = rows(lesion_table(Selection(store)))
    assert (row["modes"], row["size_presses"]) == ("quick standard", "2")
    assert (row["size_mean_mm"], row["size_spread_mm"], row["size_repeatability_index"]) == ("", "", "")


def test_presses_by_two_models_have_no_mean_and_the_row_says_by_which_models_probes_and_software(store):
    made = exam(store)
    for number, card in enumerate(("d4" * 32, "c3" * 32, "")):
        estimate = {**ESTIMATE, "mode": "paper", "model_card_sha256": card, "size_mm": unknown(9.0, half_width=0.3)}
        of_probe = (
            {"serial": f"TSIS-{number}", "software": f"0.{2 - number}.0"}
            if card
            else dict.fromkeys(("serial", "software"))
        )
        keep(store, number, estimate=estimate, exam_id=made["id"], mode="paper", **of_probe)
    [row] = rows(lesion_table(Selection(store)))
    assert (row["modes"], row["size_presses"], row["size_spread_mm"]) == ("paper", "3", "")
    assert (row["size_mean_mm"], row["size_repeatability_index"]) == ("", "")
    assert row["models"] == " ".join(("a1" * 32, "c3" * 32, "d4" * 32))
    assert (row["serials"], row["software"]) == ("TSIS-0 TSIS-1", "0.1.0 0.2.0")


def test_presses_with_an_open_end_are_counted_and_no_mean_is_made_of_them(store):
    made = exam(store)
    at_end = {**unknown(13.5, half_width=0.3), "high_is_open": True}
    for number, size in enumerate((unknown(13.0, half_width=0.3), at_end), 1):
        keep(store, number, exam_id=made["id"], estimate={**ESTIMATE, "size_mm": size})
    [row] = rows(lesion_table(Selection(store)))
    assert (row["size_presses"], row["size_open_presses"], row["depth_open_presses"]) == ("2", "1", "0")
    assert (row["size_mean_mm"], row["size_spread_mm"], row["depth_mean_mm"]) == ("", "", "6.4")


def test_a_press_that_was_voided_is_in_no_lesion_though_it_is_selected(store):
    made = exam(store)
    for number, size_mm in enumerate((9.0, 10.0, 30.0), 1):
        pressed(store, number, size_mm, exam_id=made["id"])
    store.exams.void("m-3", version=1, by="Ada", reason="Slipped")
    [row] = rows(lesion_table(Selection(store, Wanted(), with_void=True)))
    assert (row["measurements"], row["size_mean_mm"]) == ("2", "9.5")


def test_what_is_void_or_not_selected_is_in_no_row(store):
    made = exam(store)
    for number, size_mm in enumerate((9.0, 30.0, 10.0), 1):
        pressed(store, number, size_mm, exam_id=made["id"], mode="quick" if number == 3 else "standard")
    store.exams.void("m-2", version=1, by="Ada", reason="Slipped")
    [row] = rows(lesion_table(Selection(store)))
    assert (row["size_presses"], float(row["size_mean_mm"])) == ("2", 9.5)
    [row] = rows(lesion_table(Selection(store, Wanted(mode="quick"))))
    assert (row["size_presses"], float(row["size_mean_mm"])) == ("1", 10.0)


def test_a_table_of_nothing_is_its_header(store):
    assert rows(lesion_table(Selection(store))) == []
