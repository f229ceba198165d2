"""What a perfect camera sees is what the virtual probe's camera sees on average, and exactly that every time."""

from __future__ import annotations

import numpy as np
import pytest

from device.measurement.paper_mode.estimate import image_features
from device.measurement.quantities import Inclusion
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import phantom_recording
from host_tools.replication.protocol import SETTINGS, PerfectCamera


@pytest.mark.parametrize("light", ["linear", "physical"])
def test_the_noisy_camera_scatters_about_the_perfect_one(tables: ProbeTables, light: str) -> None:
    """A strong inclusion: ten frames scatter by 1 %, a press's own force and reference by another 1 %."""
    scenario, inclusion = Scenario(light=light), Inclusion(12.0, 5.0, 100.0)
    seen = image_features(phantom_recording(inclusion, tables, seed=5, scenario=scenario), SETTINGS).mean(axis=0)
    assert PerfectCamera(scenario, tables).features(inclusion, SETTINGS) == pytest.approx(seen, rel=0.02)


def test_without_an_inclusion_it_sees_nothing_at_all(tables: ProbeTables) -> None:
    camera = PerfectCamera(Scenario(light="linear"), tables)
    assert camera.features(Inclusion(0.0, 6.0, 60.0), SETTINGS) == pytest.approx(0.0, abs=1e-6)


def test_the_linear_light_is_a_straight_line_in_the_deformation(tables: ProbeTables) -> None:
    """Contrast is slope x inclusion / (slope x baseline + intercept), and both inclusions have one baseline."""
    camera = PerfectCamera(Scenario(light="linear"), tables)
    ratios = []
    for inclusion in (Inclusion(12.0, 5.0, 100.0), Inclusion(12.0, 9.0, 100.0)):
        peak_mm = np.abs(tables.centred.ramps(inclusion).inclusion_field.at(0.5).w_mm).max()
        ratios.append(camera.features(inclusion, SETTINGS)[0] / peak_mm)
    assert ratios[0] == pytest.approx(ratios[1], rel=0.05)
