"""Recordings of presses in the frames of each mode, and the committed models that read them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from daemon_process import ROOT

from device.files.bundle_file import read_quick_model, read_ramp_model
from device.measurement.mode import Mode
from device.measurement.parameters import NOMINAL
from device.measurement.quick_mode.model import QuickModel
from device.measurement.ramp_modes.model import RampModel
from device.measurement.recording.recording import Recording
from device.simulation.physics.neighbour import Neighbour
from device.simulation.physics.surface_table import PressRamps
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.recorded_presses import recorded_press

Press = Callable[..., Recording]


@pytest.fixture(scope="session")
def ramp_model() -> RampModel:
    return read_ramp_model(ROOT / "models" / "standard")


@pytest.fixture(scope="session")
def quick_model() -> QuickModel:
    return read_quick_model(ROOT / "models" / "quick")


@pytest.fixture(scope="session")
def pressed(tables: ProbeTables) -> Press:
    """A press on the nominal tissue in a mode: 12 mm, 6 mm deep, 60 kPa unless told otherwise.

    `ramps` say how the face deforms where the tables do not; `further_mm` are the offsets of a scan's further ramps.
    """

    def press(
        mode: Mode,
        unknowns: tuple[float, float, float] = (12.0, 6.0, 60.0),
        *,
        neighbour: Neighbour | None = None,
        wet_ratio: float = 0.0,
        ramps: PressRamps | None = None,
        further_mm: Sequence[float] = (),
        **nuisances: float,
    ) -> Recording:
        parameters = np.array([*unknowns, *(NOMINAL | nuisances).values()])
        return recorded_press(
            tables,
            parameters,
            mode,
            5,
            neighbour=neighbour,
            wet_ratio=wet_ratio,
            ramps=ramps,
            further_mm=further_mm,
        )

    return press
