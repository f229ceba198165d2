"""The file says what the rows said, with units, and writing it takes no more memory for more scenes."""

import tracemalloc
from contextlib import nullcontext

import numpy as np
import pytest
from sweep_rows import synthetic_row, synthetic_rows

from device.measurement.quantities import InvalidQuantity
from host_tools.data import dataset_file
from host_tools.data import sweep as sweep_module
from host_tools.data.dataset import read_dataset
from host_tools.data.dataset_file import BLOCK_SCENES, write_dataset
from host_tools.data.journal import Journal
from host_tools.data.plan import SweepPlan
from host_tools.data.rows import empty_row
from host_tools.data.sweep import sweep


def _written(folder, plan, rows):
    journal = Journal(folder / "j", plan.as_record())
    for row in rows:
        journal.append(row)
    journal.close()
    write_dataset(journal, folder / "s.nc")
    return read_dataset(folder / "s.nc")


def test_every_block_of_scenes_is_written_at_its_place(tmp_path):
    plan = SweepPlan(BLOCK_SCENES + 3, 1)
    rows = [synthetic_row(i, truth) for i, truth in enumerate(plan.truths())]
    dataset = _written(tmp_path, plan, reversed(rows))
    np.testing.assert_array_equal(dataset["w_mm"].values, [row["w_mm"] for row in rows])
    np.testing.assert_array_equal(dataset["depth_mm"].values, plan.truths()[:, 1])


def test_stated_errors_are_relative_and_a_failed_row_is_nan(tmp_path):
    plan = SweepPlan(2, 1)
    failed, truth = plan.truths()
    solved = synthetic_row(1, truth) | {"force_n": 0.5, "stated_error_force_n": 1e-3}
    dataset = _written(tmp_path, plan, [empty_row(0, failed, reason="no mesh — π"), solved])
    assert (dataset["force_n"].attrs["units"], dataset["stated_error_force_n"].attrs["units"]) == ("N", "1")
    np.testing.assert_array_equal(dataset["stated_error_force_n"].values, [np.nan, 1e-3])
    assert np.isnan(dataset["w_mm"].values[0]).all()
    assert dataset["reason"].values.tolist() == ["no mesh — π", ""]


def test_a_sweep_that_solved_nothing_writes_no_file(tmp_path):
    plan = SweepPlan(1, 1)
    with pytest.raises(InvalidQuantity, match="the first reason was: no mesh; all reasons stand in "):
        _written(tmp_path, plan, [empty_row(0, plan.truths()[0], reason="no mesh.")])
    assert not (tmp_path / "s.nc").exists()


def test_memory_does_not_grow_with_the_number_of_scenes(tmp_path, monkeypatch):
    monkeypatch.setattr(sweep_module, "executor", lambda **_: nullcontext(synthetic_rows))
    monkeypatch.setattr(dataset_file, "BLOCK_SCENES", 16)
    peaks = []
    for turn, scenes in enumerate((32, 32, 128)):  # the first one pays for imports
        tracemalloc.start()
        sweep(SweepPlan(scenes, 1), tmp_path / f"{turn}.nc")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.1 * peaks[1]
