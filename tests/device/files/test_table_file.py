"""A table on disk: comes back as written, and is refused when it is not what its record says."""

import json

import numpy as np
import pytest

from device.files.table_file import load_table, save_table
from device.measurement.quantities import InvalidQuantity

SCHEMA = "tsis.example/1"
ARRAYS = {"r_mm": np.linspace(0, 1, 5), "w_mm": np.arange(10.0).reshape(2, 5)}


@pytest.fixture
def folder(tmp_path):
    save_table(tmp_path, "some_table", ARRAYS, {"schema": SCHEMA, "command": "make it", "origin": 7})
    return tmp_path


def load(folder, keys=("r_mm", "w_mm")):
    return load_table(folder, "some_table", SCHEMA, keys, "make it again")


def test_arrays_and_record_come_back(folder):
    arrays, record = load(folder)
    for name, values in ARRAYS.items():
        np.testing.assert_allclose(arrays[name], values, rtol=1e-7)
    assert (record["origin"], record["command"]) == (7, "make it")


def test_a_changed_byte_is_refused(folder):
    path = folder / "some_table.npz"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(InvalidQuantity, match="some table's hash"):
        load(folder)


@pytest.mark.parametrize("name", ["some_table.npz", "some_table.json"])
def test_a_missing_file_is_refused(folder, name):
    (folder / name).unlink()
    with pytest.raises(InvalidQuantity, match=r"some table is .*make it again"):
        load(folder)


def test_another_schema_is_refused(folder):
    path = folder / "some_table.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"schema": "tsis.example/0"}))
    with pytest.raises(InvalidQuantity, match=r"schema is tsis.example/0"):
        load(folder)


def test_a_missing_array_is_refused_by_name(folder):
    with pytest.raises(InvalidQuantity, match="p_kpa"):
        load(folder, ("r_mm", "p_kpa"))


def test_a_changed_record_is_refused_as_a_changed_array_is(folder):
    path = folder / "some_table.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"origin": 8}))
    with pytest.raises(InvalidQuantity, match="some table's hash"):
        load(folder)
