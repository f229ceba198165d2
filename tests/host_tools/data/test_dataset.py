"""A data set with holes trains without them, says how many, or is refused by name."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from device.measurement.paper_mode.estimate import PAPER_UNITS
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from host_tools.__main__ import app
from host_tools.data.dataset import require_enough, training_rows
from host_tools.data.plan import SCHEMA
from host_tools.paper_network.train import train

SCENES = 80
COLUMNS = (*UNKNOWNS, *PAPER_UNITS)


@pytest.fixture
def dataset() -> xr.Dataset:
    """Eighty random scenes with random features, as `host_tools sweep` would lay them out."""
    rng = np.random.default_rng(2)
    truth = rng.uniform((0.5, 4.0, 40.0), (15.0, 12.0, 120.0), (SCENES, 3))
    features = rng.uniform(0.5, 2.0, (SCENES, 3)) * truth[:, :1] * [0.01, 1.0, 10.0]
    columns = {name: ("scene", values) for name, values in zip(COLUMNS, np.hstack([truth, features]).T, strict=True)}
    origin = json.dumps({"scene_defaults": {"force_n": 0.5}})
    reason = ("scene", np.full(SCENES, "", dtype=object))
    return xr.Dataset({**columns, "reason": reason}, attrs={"schema": SCHEMA, "origin": origin})


def written(dataset: xr.Dataset, folder: Path) -> Path:
    path = folder / "s.nc"
    dataset.to_netcdf(path, engine="h5netcdf")
    return path


def test_a_whole_data_set_trains_with_all_of_its_rows(dataset: xr.Dataset, tmp_path: Path) -> None:
    rows = training_rows(written(dataset, tmp_path))
    assert (len(rows.features), rows.excluded_rows, len(rows.phantom_index)) == (SCENES, 0, 9)


@pytest.mark.parametrize("column", COLUMNS)
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_row_without_a_number_is_left_out_and_counted(
    dataset: xr.Dataset, tmp_path: Path, column: str, value: float
) -> None:
    dataset[column][[3, 50]] = value
    rows = training_rows(written(dataset, tmp_path))
    kept = np.delete(np.arange(SCENES), [3, 50])
    assert rows.excluded_rows == 2
    np.testing.assert_array_equal(rows.truth[:, 1], dataset["depth_mm"].values[kept])
    assert np.isfinite(np.hstack([rows.features, rows.truth])).all()


def test_a_row_that_failed_and_lacks_numbers_counts_once(dataset: xr.Dataset, tmp_path: Path) -> None:
    dataset["reason"][7], dataset["max_deformation_mm"][7] = "no mesh", np.nan
    dataset["reason"][8] = "the contact opens"
    assert training_rows(written(dataset, tmp_path)).excluded_rows == 2


@pytest.mark.parametrize("column", [*COLUMNS, "reason"])
def test_a_missing_column_is_named(dataset: xr.Dataset, tmp_path: Path, column: str) -> None:
    with pytest.raises(InvalidQuantity, match=f"{column} is missing"):
        training_rows(written(dataset.drop_vars(column), tmp_path))


def test_a_missing_origin_is_named(dataset: xr.Dataset, tmp_path: Path) -> None:
    del dataset.attrs["origin"]
    with pytest.raises(InvalidQuantity, match="origin is missing"):
        training_rows(written(dataset, tmp_path))


@pytest.mark.parametrize(("lacking", "left"), [(12, 59), (SCENES, 0)])
def test_what_is_left_must_suffice_for_the_network(
    dataset: xr.Dataset, tmp_path: Path, lacking: int, left: int
) -> None:
    """Nine of the rest are phantoms."""
    dataset["youngs_modulus_kpa"][:lacking] = np.nan
    with pytest.raises(InvalidQuantity, match=f"training rows is {left}, but must be at least 60"):
        train(training_rows(written(dataset, tmp_path)), trials=2)


def test_train_prints_how_many_rows_it_leaves_out(dataset: xr.Dataset, tmp_path: Path) -> None:
    dataset["depth_mm"][[1, 2, 3]] = np.nan
    path = written(dataset, tmp_path)
    done = CliRunner().invoke(app, ["train", "--data", str(path), "--out", str(tmp_path / "m"), "--trials", "2"])
    assert done.exit_code == 0
    assert f"3 scenes of {path}, failed or without a number, are left out." in done.output
    assert json.loads((tmp_path / "m" / "model.json").read_text())["excluded_rows"] == 3


@pytest.mark.parametrize("verb", ["train", "paper"])
@pytest.mark.parametrize(("lacking", "usable"), [(12, 68), (72, 8), (SCENES, 0)])
def test_too_few_rows_are_refused_by_their_number_and_file_before_anything_begins(
    dataset: xr.Dataset, tmp_path: Path, verb: str, lacking: int, usable: int
) -> None:
    dataset["youngs_modulus_kpa"][:lacking] = np.nan
    path = written(dataset, tmp_path)
    out = {"train": ["--out", str(tmp_path / "model")], "paper": []}[verb]
    done = CliRunner().invoke(app, [verb, "--data", str(path), *out])
    assert isinstance(done.exception, InvalidQuantity)
    found = f"usable rows of {path} is {usable} of 80"
    bound = "at least 69, 60 that train and 9 phantoms that never do"
    assert str(done.exception) == f"{found}, but must be {bound}: sweep more scenes."
    assert done.output.strip().splitlines() == [
        f"{lacking} scenes of {path}, failed or without a number, are left out."
    ]


def test_just_enough_rows_suffice(dataset: xr.Dataset, tmp_path: Path) -> None:
    dataset["youngs_modulus_kpa"][:11] = np.nan
    path = written(dataset, tmp_path)
    rows = training_rows(path)
    require_enough(rows, path)
    assert len(rows.training_index) == 60


@pytest.mark.parametrize("trials", ["0", "1"])
def test_too_few_networks_are_refused_before_the_first_is_trained(
    dataset: xr.Dataset, tmp_path: Path, trials: str
) -> None:
    asked = ["train", "--data", str(written(dataset, tmp_path)), "--trials", trials, "--out", str(tmp_path / "model")]
    done = CliRunner().invoke(app, asked)
    assert f"trials is {trials}, but must be at least 2" in str(done.exception)
    assert done.output == ""
