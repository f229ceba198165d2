"""A sweep to compare with."""

import pytest
import xarray as xr
from sweep_rows import SCENES

from host_tools.data.dataset import read_dataset
from host_tools.data.plan import SweepPlan
from host_tools.data.sweep import sweep


@pytest.fixture(scope="session")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> xr.Dataset:
    """A few scenes, solved here one after the other."""
    return read_dataset(sweep(SweepPlan(SCENES, 4), tmp_path_factory.mktemp("sweep") / "whole.nc", jobs=1))
