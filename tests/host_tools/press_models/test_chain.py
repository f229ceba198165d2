"""The whole chain in small: from the probe's tables to a bundle, and from that to an answer of the device."""

from __future__ import annotations

import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.files.certificate_file import read_calibration
from device.files.shipped import SIMULATED_PROBE
from device.measurement.parameters import NOMINAL
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.estimate import estimate_ramp
from device.measurement.ramp_modes.model import RAMP_MODES
from device.simulation.scenario import SERIALS
from host_tools.press_models import ramp_training
from host_tools.press_models.export import export_ramp
from host_tools.press_models.ramp_training import DRY_RUN, train_ramp
from host_tools.press_models.recorded_presses import recorded_press
from host_tools.probe_tables.out_of_range_table import ASIDE_POINTS, POINTS, WideTable

INCLUSION = np.array([10.0, 6.0, 60.0, *NOMINAL.values()])


def as_at_the_nearest_inside(tables) -> WideTable:
    """Stand-in for 25 minutes of solves: fields around the ranges are those of the nearest inclusion inside."""
    centred, aside = tables.centred.lump_per_n_mm3.shape[-2:], tables.off_axis.lump_per_n_mm3.shape[-2:]
    return WideTable(np.zeros((2, *POINTS, *centred)), np.zeros((2, *ASIDE_POINTS, *aside)))


def keep(monkeypatch, name, found) -> None:
    """Keep what a step of the training returns."""
    step = getattr(ramp_training, name)

    def kept(*arguments, **options):
        found.append(step(*arguments, **options))
        return found[-1]

    monkeypatch.setattr(ramp_training, name, kept)


@pytest.mark.long  # some two minutes: presses, recordings, networks, and both modes' answers
def test_tables_become_a_bundle_whose_answers_the_device_gives(tables, tmp_path, monkeypatch):
    folder, missed = tmp_path / "standard", []
    for name in ("surrogate_error", "table_error"):
        keep(monkeypatch, name, missed)
    trained = train_ramp(tables, as_at_the_nearest_inside(tables), budget=DRY_RUN, seed=1, jobs=1)
    export_ramp(trained, folder, serials=(SERIALS["physical"],), software_version="1", training_command="a test")
    model, calibration = read_ramp_model(folder), read_calibration(SIMULATED_PROBE / "calibration.json")
    model.prove()
    assert trained.surrogate_error.max() < 0.02
    np.testing.assert_array_equal(model.answers.noise.forward, sum(missed))
    assert all(one.any() for one in missed)
    for mode in RAMP_MODES:
        further = (4.0,) if mode == "precise" else ()
        recording = recorded_press(tables, INCLUSION, mode, 7, further_mm=further)
        estimate = estimate_ramp(recording, mode, model, calibration)
        assert estimate.model_sha256 == model.bundle.sha256
        assert estimate.status in ("ok", "partly_identifiable", "outside_range")
        if estimate.status != "outside_range":
            found = [getattr(estimate, name) for name in UNKNOWNS[:2]]
            assert [one.value for one in found] == pytest.approx(INCLUSION[:2], rel=0.25)
