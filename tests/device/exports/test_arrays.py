"""Arrays: numbers are numbers, nothing is pickled, and the selection has a bound."""

import io

import numpy as np
import pytest
from kept_measurements import keep, taken

from device.errors import InvalidRequest
from device.exports import arrays
from device.exports.arrays import npz_of
from device.exports.selection import Selection
from device.exports.table import WIDE_COLUMNS
from device.records.exams import ExamContent
from device.records.store import Store


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


def loaded(store):
    with np.load(io.BytesIO(npz_of(Selection(store))), allow_pickle=False) as file:
        return dict(file)


def test_each_column_is_an_array_in_one_order(store):
    content = ExamContent(kind="patient", patient_ref="A-17", operator="Åse", clock_position=3)
    made = store.exams.make(content, issuer="HOSP")
    keep(store, 1, exam_id=made["id"], features={"b": 2.0, "a": 1.0})
    keep(store, 2, status="no_contact", features={"a": 3.0})
    found = loaded(store)
    assert set(found) == {*WIDE_COLUMNS, "features", "feature_names"}
    assert {one.shape[0] for name, one in found.items() if name != "feature_names"} == {2}
    assert list(found["taken_at_utc"]) == [taken(2), taken(1)]
    assert list(found["patient_ref"]) == ["", "A-17"]
    assert list(found["patient_issuer"]) == ["", "HOSP"]
    assert found["size_mm"][1] == 10.2
    assert np.isnan(found["size_mm"][0])
    assert list(found["size_identifiable"]) == [0, 1]
    assert np.isnan(found["youngs_modulus_kpa"][1])
    assert found["youngs_modulus_low_kpa"][1] == 51.0
    assert list(found["reached"]) == [-1, -1]
    assert list(found["feature_names"]) == ["a", "b"]
    np.testing.assert_array_equal(found["features"], [[3.0, np.nan], [1.0, 2.0]])


def test_what_is_a_number_has_a_numbers_type_and_what_is_text_a_texts(store):
    keep(store, 1, truth={"size_mm": 1.0, "depth_mm": 2.0, "youngs_modulus_kpa": 3.0}, reached=True)
    kinds = {name: one.dtype.kind for name, one in loaded(store).items()}
    numbers = {name for name in kinds if name.endswith(("_mm", "_kpa", "_n"))}
    assert {kinds[name] for name in numbers | {"clock_position", "within_s", "features"}} == {"f"}
    assert {
        kinds[name] for name in ("seq", "measurement_version", "ramps", "reached", "simulated", "depth_low_is_open")
    } == {"i"}
    assert {
        kinds[name] for name in ("measurement_id", "voided_at", "exam_changed_at", "model_sha256", "note", "status")
    } == {"U"}


def test_arrays_of_nothing_are_empty(store):
    found = loaded(store)
    assert (found["size_mm"].shape, found["features"].shape) == ((0,), (0, 0))


def test_too_many_are_refused_with_what_to_do(store, monkeypatch):
    monkeypatch.setattr(arrays, "MOST", 1)
    keep(store, 1)
    assert loaded(store)["seq"].shape == (1,)
    keep(store, 2)
    with pytest.raises(InvalidRequest, match="more than 1 measurements.*Choose fewer"):
        npz_of(Selection(store))
