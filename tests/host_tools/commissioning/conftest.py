"""What commissioning starts from: the design's model of ramps, and its derivatives by what a builder leaves open."""

from __future__ import annotations

import pytest

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.ramp_modes.commissioned.row_derivatives import RowDerivatives
from device.measurement.ramp_modes.model import RampModel
from host_tools.press_models.press_derivatives import load_derivatives


@pytest.fixture(scope="package")
def model() -> RampModel:
    return read_ramp_model(MODELS / "standard")


@pytest.fixture(scope="package")
def derivatives() -> RowDerivatives:
    return load_derivatives(SIMULATED_PROBE)
