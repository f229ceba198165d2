"""Exports over REST: files with their types and names, of what was asked for, refused where that is none."""

import csv
import io
import zipfile

import numpy as np
import pytest
import xarray
from kept_measurements import keep

from device.records.exams import ExamContent


@pytest.fixture(autouse=True)
def _kept(store):
    for number in (1, 2, 3):
        keep(store, number, mode="quick" if number == 2 else "standard")


def test_a_table_is_downloaded_as_one(get):
    answer = get("exports/measurements.csv", mode="quick")
    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    assert answer.headers["content-disposition"] == 'attachment; filename="tsis-measurements.csv"'
    header, row = answer.text.splitlines()
    assert (header.split(",")[0], row.split(",")[0]) == ("measurement_id", "m-2")


def test_the_long_form_has_a_row_a_quantity(get):
    assert len(get("exports/measurements.csv", form="long", mode="quick").text.splitlines()) == 1 + 5


def test_presses_of_a_lesion_are_its_row_and_the_same_is_said_of_its_exam(store, get):
    exam = store.exams.make(ExamContent(kind="patient", patient_ref="A-1", operator="Ada"))
    for number in (4, 5, 6):
        keep(store, number, exam_id=exam["id"])
    store.exams.void("m-6", version=1, by="Ada", reason="Slipped")
    answer = get("exports/measurements.csv", form="lesions")
    assert answer.headers["content-disposition"] == 'attachment; filename="tsis-lesions.csv"'
    [row] = csv.DictReader(io.StringIO(answer.text, newline=""))
    assert (row["exam_id"], row["measurements"], row["size_presses"]) == (exam["id"], "2", "2")
    said = get(f"exams/{exam['id']}/lesion").json()
    assert (said["measurements"], said["youngs_modulus_kpa"]["presses"]) == (2, 0)
    assert said["size_mm"] == {
        "presses": 2, "mean": 10.2, "spread": 0.0, "repeatability_index": 0.0, "open_presses": 0
    }  # fmt: skip
    assert float(row["size_mean_mm"]) == said["size_mm"]["mean"]


def test_an_exam_without_measurements_has_no_agreement_and_none_is_not_found(store, get):
    exam = store.exams.make(ExamContent(kind="patient", patient_ref="A-1", operator="Ada"))
    said = get(f"exams/{exam['id']}/lesion").json()
    assert (said["measurements"], said["size_mm"]["mean"]) == (0, None)
    assert get("exams/0b0f7f2e-6a1f-4d53-9d5e-0a8a4a2f6c11/lesion").status_code == 404


def test_arrays_are_numpys(get):
    with np.load(io.BytesIO(get("exports/measurements.npz").content), allow_pickle=False) as file:
        assert list(file["measurement_id"]) == ["m-3", "m-2", "m-1"]


def test_a_data_set_is_netcdf_of_what_was_selected(get):
    answer = get("exports/measurements.nc", mode="standard")
    assert answer.headers["content-type"] == "application/x-netcdf"
    assert answer.headers["content-disposition"] == 'attachment; filename="tsis-measurements.nc"'
    with xarray.open_dataset(io.BytesIO(answer.content), engine="h5netcdf") as found:
        assert list(found["measurement_id"].values) == ["m-3", "m-1"]
        assert found.attrs["source"] == "probe SIM-0001"


def test_recordings_are_one_zip(get):
    with zipfile.ZipFile(io.BytesIO(get("exports/recordings.zip", mode="standard").content)) as archive:
        assert archive.namelist() == ["measurements.csv", "recordings/r-3.zip", "recordings/r-1.zip", "missing.csv"]


@pytest.mark.parametrize("path", ["measurements.csv", "measurements.npz", "measurements.nc", "recordings.zip"])
def test_what_would_be_an_empty_file_by_mistake_is_refused(get, path):
    unknown = get(f"exports/{path}", exam_id="0b0f7f2e-6a1f-4d53-9d5e-0a8a4a2f6c11")
    assert (unknown.status_code, unknown.json()["code"]) == (404, "E802")
    turned = get(f"exports/{path}", **{"from": "2026-03-05T00:00:00Z", "to": "2026-03-04T00:00:00Z"})
    assert (turned.status_code, turned.json()["code"]) == (422, "E803")
    assert "from is 2026-03-05T" in turned.json()["detail"]
    assert "query.to, 2026-03-04T" in turned.json()["detail"]


def test_who_comes_back_for_what_is_new_exports_that_alone(store, get):
    newest = store.measurement("m-3")["seq"]
    assert len(get("exports/measurements.csv", after_seq=newest - 1).text.splitlines()) == 1 + 1
    assert len(get("exports/measurements.csv", after_seq=newest).text.splitlines()) == 1


def test_what_was_voided_comes_only_when_it_is_asked_for(store, get):
    store.exams.void("m-3", version=1, by="Ada", reason="Slipped")
    assert len(get("exports/measurements.csv").text.splitlines()) == 1 + 2
    assert len(get("exports/measurements.csv", with_void="true").text.splitlines()) == 1 + 3


@pytest.mark.parametrize("path", ["measurements.csv", "measurements.npz", "measurements.nc", "recordings.zip"])
@pytest.mark.parametrize("query", [{"exam": "x"}, {"mode": "fast"}, {"outcome": "done"}, {"from": "now"}, {"limit": 1}])
def test_a_selection_that_is_none_is_refused(get, path, query):
    answer = get(f"exports/{path}", **query)
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
