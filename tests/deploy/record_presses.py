"""Records a simulated press for each mode into a folder: record_presses.py FOLDER."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from device.files.recording_file import write_recording
from device.files.shipped import SIMULATED_PROBE
from device.measurement.parameters import HIGH, LOW
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.recorded_presses import recorded_press

MODES = ("paper", "quick", "standard", "precise")

if __name__ == "__main__":
    tables, folder = ProbeTables.load(SIMULATED_PROBE), Path(sys.argv[1])
    parameters = (LOW + HIGH) / 2
    for seed, mode in enumerate(MODES):
        write_recording(recorded_press(tables, np.asarray(parameters), mode, seed), folder / mode)
