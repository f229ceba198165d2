"""Exports over REST: files with their types and names, of what was asked for, refused where that is none."""

import asyncio
import io
import types
import zipfile

import httpx
import numpy as np
import pytest
from kept_measurements import keep

from device.records.store import Store
from device.web.app import create_app


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    for number in (1, 2, 3):
        keep(opened, number, mode="quick" if number == 2 else "standard")
    yield opened
    opened.close()


@pytest.fixture
def get(store):
    app = create_app(types.SimpleNamespace(), store)

    def getting(path, **query):
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                return await client.get(f"/api/v1/exports/{path}", params=query)

        return asyncio.run(answer())

    return getting


def test_a_table_is_downloaded_as_one(get):
    answer = get("measurements.csv", mode="quick")
    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    assert answer.headers["content-disposition"] == 'attachment; filename="tsis-measurements.csv"'
    header, row = answer.text.splitlines()
    assert (header.split(",")[0], row.split(",")[0]) == ("measurement_id", "m-2")


def test_the_long_form_has_a_row_a_quantity(get):
    assert len(get("measurements.csv", form="long", mode="quick").text.splitlines()) == 1 + 5


def test_arrays_are_numpys(get):
    with np.load(io.BytesIO(get("measurements.npz").content), allow_pickle=False) as file:
        assert list(file["measurement_id"]) == ["m-3", "m-2", "m-1"]


def test_recordings_are_one_zip(get):
    with zipfile.ZipFile(io.BytesIO(get("recordings.zip", mode="standard").content)) as archive:
        assert archive.namelist() == ["measurements.csv", "recordings/r-3.zip", "recordings/r-1.zip", "missing.csv"]


def test_what_was_voided_comes_only_when_it_is_asked_for(store, get):
    store.exams.void("m-3", version=1, by="Ada", reason="Slipped")
    assert len(get("measurements.csv").text.splitlines()) == 1 + 2
    assert len(get("measurements.csv", with_void="true").text.splitlines()) == 1 + 3


@pytest.mark.parametrize("path", ["measurements.csv", "measurements.npz", "recordings.zip"])
@pytest.mark.parametrize("query", [{"exam": "x"}, {"mode": "fast"}, {"outcome": "done"}, {"from": "now"}, {"limit": 1}])
def test_a_selection_that_is_none_is_refused(get, path, query):
    answer = get(path, **query)
    assert (answer.status_code, answer.json()["code"]) == (422, "E803")
