"""What a probe exports as arrays is the same in netCDF, with units, and a file that is none is refused."""

import os

import numpy as np
import pytest
import xarray as xr
from kept_measurements import keep

from device.exports.arrays import npz_of
from device.exports.selection import Selection
from device.measurement.quantities import InvalidQuantity
from device.records.exams import ExamContent
from device.records.store import Store
from host_tools.data.exported import write_netcdf


@pytest.fixture
def exported(tmp_path):
    store = Store(tmp_path / "var")
    exam = store.exams.make(ExamContent(kind="patient", patient_ref="Ä-17", operator="Ada"))
    keep(store, 1, exam_id=exam["id"])
    keep(store, 2, status="no_contact")
    path = tmp_path / "measurements.npz"
    path.write_bytes(npz_of(Selection(store)))
    store.close()
    return path


def test_every_column_is_there_with_its_unit(exported, tmp_path):
    assert write_netcdf(exported, tmp_path / "all.nc") == 2
    with (
        xr.open_dataset(tmp_path / "all.nc", engine="h5netcdf") as found,
        np.load(exported, allow_pickle=False) as arrays,
    ):
        for name in set(arrays.files) - {"features", "feature_names"}:
            assert found[name].dims == ("measurement",)
            np.testing.assert_array_equal(found[name].values.astype(arrays[name].dtype), arrays[name])
        np.testing.assert_array_equal(found["features"], arrays["features"])
        assert list(found["feature"].values) == list(arrays["feature_names"])
        assert (found["size_mm"].units, found["youngs_modulus_kpa"].units, found["force_n"].units) == ("mm", "kPa", "N")
        assert list(found["patient_ref"].values) == ["", "Ä-17"]
        assert found["seq"].attrs == {}
        assert dict(zip(found["feature"].values, found["feature_unit"].values, strict=True))["force_n"] == "N"


def test_what_releases_of_before_exported_of_something_undetermined_is_no_value(exported, tmp_path):
    with np.load(exported, allow_pickle=False) as arrays:
        flags = np.array([1, 0], arrays["youngs_modulus_identifiable"].dtype)
        of_before = dict(arrays) | {"youngs_modulus_kpa": np.full(2, 80.0), "youngs_modulus_identifiable": flags}
    np.savez(tmp_path / "of_before.npz", **of_before)
    write_netcdf(tmp_path / "of_before.npz", tmp_path / "all.nc")
    with xr.open_dataset(tmp_path / "all.nc", engine="h5netcdf") as found:
        np.testing.assert_array_equal(found["youngs_modulus_kpa"], [80.0, np.nan])


def test_what_is_no_export_is_refused_and_nothing_written(exported, tmp_path):
    out, other = tmp_path / "all.nc", tmp_path / "other.npz"
    other.write_bytes(b"no archive")
    with pytest.raises(InvalidQuantity, match="exports/measurements.npz"):
        write_netcdf(other, out)
    np.savez(other, size_mm=np.zeros(1))
    with pytest.raises(InvalidQuantity, match="without depth_identifiable, depth_mm, feature_names"):
        write_netcdf(other, out)
    assert not out.exists()


def test_a_file_that_is_there_stays(exported, tmp_path):
    out = tmp_path / "all.nc"
    out.write_bytes(b"mine")
    with pytest.raises(FileExistsError, match="choose another name"):
        write_netcdf(exported, out)
    assert out.read_bytes() == b"mine"


def test_a_full_disk_leaves_no_data_set(exported, tmp_path, monkeypatch):
    def full(descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_netcdf(exported, tmp_path / "all.nc")
    assert not (tmp_path / "all.nc").exists()
