"""The data set is the arrays of the same selection, with units, and what the toolkit makes of kept arrays."""

import io
import re
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from kept_measurements import keep

from device import __version__
from device.errors import InvalidRequest
from device.exports import arrays
from device.exports.arrays import netcdf_of, npz_of
from device.exports.selection import Selection
from device.records.exams import ExamContent
from device.records.store import Store
from host_tools.data.exported import write_netcdf


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    exam = opened.exams.make(ExamContent(kind="patient", patient_ref="Ä-17", operator="王"))
    keep(opened, 1, exam_id=exam["id"], features={"force_n": 0.5, "contrast_0.9_mm": 0.25})
    keep(opened, 2, status="no_contact", features={"force_n": 0.25})
    yield opened
    opened.close()


def dataset(content):
    return xr.load_dataset(io.BytesIO(content), engine="h5netcdf")


def test_every_array_is_a_variable_with_its_unit(store):
    found = dataset(netcdf_of(Selection(store)))
    with np.load(io.BytesIO(npz_of(Selection(store))), allow_pickle=False) as kept:
        assert set(found.variables) == {*kept.files, "feature", "feature_unit"} - {"feature_names"}
        for name in set(kept.files) - {"features", "feature_names"}:
            assert found[name].dims == ("measurement",)
            np.testing.assert_array_equal(found[name].values.astype(kept[name].dtype), kept[name])
        np.testing.assert_array_equal(found["features"], kept["features"])
        assert list(found["feature"].values) == list(kept["feature_names"])
    assert (found["size_mm"].units, found["youngs_modulus_kpa"].units, found["force_n"].units) == ("mm", "kPa", "N")
    assert (found["within_s"].units, found["until_depth_mm"].units) == ("s", "mm")
    units = dict(zip(found["feature"].values, found["feature_unit"].values, strict=True))
    assert units == {"force_n": "N", "contrast_0.9_mm": "1"}
    assert list(found["patient_ref"].values) == ["", "Ä-17"]
    history = found.attrs.pop("history")
    assert re.fullmatch(rf"\d{{4}}-\d\d-\d\dT\d\d:\d\d:\d\dZ exported by release {re.escape(__version__)}", history)
    expected = {"schema": "tsis.measurements/1", "source": "probe SIM-0001", "interval_level_percent": 90.0}
    assert found.attrs == {"Conventions": "CF-1.8", **expected}
    assert found["size_mm"].long_name == "diameter of the inclusion"
    assert found["depth_low_mm"].long_name.startswith("lower end of the 90 % interval, depth of the inclusion's top")
    assert np.isnan(found["youngs_modulus_std_kpa"]).all()
    assert found["youngs_modulus_kpa"].comment == found["youngs_modulus_std_kpa"].comment
    assert found["youngs_modulus_kpa"].comment.startswith("NaN where the press does not determine it")
    assert "comment" not in found["youngs_modulus_low_kpa"].attrs
    assert list(found["serial"].values) == ["SIM-0001", "SIM-0001"]


def test_its_source_is_the_probes_that_measured(store):
    assert dataset(netcdf_of([])).source == "no measurement"
    keep(store, 3, serial="TSIS-0042")
    keep(store, 4, serial=None)
    assert dataset(netcdf_of(Selection(store))).source == "probes unknown, SIM-0001, TSIS-0042"


def test_the_toolkit_makes_the_same_of_arrays_that_were_kept(store, tmp_path):
    npz = tmp_path / "measurements.npz"
    npz.write_bytes(npz_of(Selection(store)))
    write_netcdf(npz, tmp_path / "measurements.nc")
    made = xr.load_dataset(tmp_path / "measurements.nc", engine="h5netcdf")
    exported = dataset(netcdf_of(Selection(store)))
    xr.testing.assert_equal(made, exported)
    assert all(made[name].attrs.keys() == exported[name].attrs.keys() for name in made.variables)
    assert made.attrs | {"history": ""} == exported.attrs | {"history": ""}
    assert made.history.endswith(f"Z made of measurements.npz by release {__version__}")


def test_arrays_of_a_release_that_said_no_probe_are_of_an_unknown_one(store, tmp_path):
    of_before = arrays.arrays_of(Selection(store))
    del of_before["serial"]
    np.savez(tmp_path / "of_before.npz", **of_before)
    write_netcdf(tmp_path / "of_before.npz", tmp_path / "measurements.nc")
    assert xr.load_dataset(tmp_path / "measurements.nc", engine="h5netcdf").source == "probe unknown"


def test_what_is_true_or_false_is_a_flag_of_cf_and_stays_a_whole_number(store):
    keep(store, 3, reached=True)
    found = dataset(netcdf_of(Selection(store)))
    flags = {name for name, one in found.variables.items() if one.dtype == np.int8}
    assert {"reached", "simulated", "size_identifiable", "depth_low_is_open"} <= flags
    for name in flags:
        meanings = dict(zip(found[name].flag_values, found[name].flag_meanings.split(), strict=True))
        assert meanings == {-1: "not_known", 0: "false", 1: "true"}
        assert found[name].flag_values.dtype == found[name].dtype
    assert list(found["reached"].values) == [1, -1, -1]


def test_a_count_that_is_not_known_is_below_the_least_valid_one(store):
    keep(store, 3, ramps=None)
    ramps = dataset(netcdf_of(Selection(store)))["ramps"]
    assert list(ramps.values < ramps.valid_min) == [True, False, False]
    assert ramps.dtype == ramps.valid_min.dtype == np.int64


def test_a_data_set_of_nothing_can_be_read(tmp_path):
    store = Store(tmp_path / "empty")
    found = dataset(netcdf_of(Selection(store)))
    assert (found["size_mm"].shape, found["features"].shape, found["patient_ref"].shape) == ((0,), (0, 0), (0,))
    store.close()


def test_too_many_are_refused(store, monkeypatch):
    monkeypatch.setattr(arrays, "MOST", 1)
    with pytest.raises(InvalidRequest, match="Choose fewer"):
        netcdf_of(Selection(store))


def test_its_libraries_are_loaded_with_the_first_export_alone():
    said = "import sys, device.web.app; print({'h5py', 'h5netcdf'} & set(sys.modules))"
    assert subprocess.check_output([sys.executable, "-c", said], text=True).strip() == "set()"
