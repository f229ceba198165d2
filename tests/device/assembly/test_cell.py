"""The load cell of the simulated probe: its tares, that of commissioning and that of this start, on either protocol."""

import threading
from dataclasses import replace

import pytest

from device.assembly.cell import open_cell, tared_once_lifted
from device.assembly.opened_parts import StartFailed
from device.assembly.probe import open_phantom_press, open_simulated_probe
from device.config import simulated_config
from device.errors import UnpluggedCellError, ZeroShiftError
from device.simulation.chips.emulated_amplifier import EmulatedBridge
from device.simulation.chips.openscale_line import EmulatedOpenScale
from device.simulation.scenario import CellSettings, Scenario


@pytest.fixture
def opened(tmp_path):
    """Open a virtual probe whose cell reads so many counts when free; close it in the end."""
    procedures = []

    def open_with(zero_counts, **settings):
        config = simulated_config()
        config = replace(config, data=tmp_path, cell=replace(config.cell, **settings))
        procedures.append(open_simulated_probe(config, Scenario(cell=CellSettings(zero_counts=zero_counts))))
        procedures[-1].start()
        return procedures[-1]

    yield open_with
    for procedure in procedures:
        procedure.close()


@pytest.mark.parametrize("settings", [{}, {"commissioned_tare_counts": -50_000.0}])
def test_a_zero_far_from_that_of_commissioning_keeps_the_probe_from_measuring(opened, settings):
    """30 000 counts are 0.22 N from the virtual probe's own 8200, and 0.8 N from what the settings may say."""
    procedure = opened(30_000.0, **settings)
    for refused in (procedure.require_ready, lambda: procedure.bench.force.latest_n):
        with pytest.raises(ZeroShiftError, match="from the .* of commissioning"):
            refused()


def test_a_zero_far_from_that_of_commissioning_keeps_a_phantom_from_being_recorded(tmp_path):
    """It is told at once: a command has no screen on which to wait."""
    config = replace(simulated_config(), data=tmp_path)
    with pytest.raises(StartFailed) as refusal:
        open_phantom_press(config, Scenario(cell=CellSettings(zero_counts=30_000.0)))
    assert [fault.code for fault in refusal.value.faults] == ["E306"]


@pytest.mark.parametrize("protocol", ["openscale", "mantracourt"])
def test_a_zero_near_that_of_commissioning_is_the_zero_of_force(opened, protocol):
    """Twenty readings of 40 counts' noise: the tare is good to 0.1 mN, and the force read to 0.4 mN."""
    assert abs(opened(20_000.0, protocol=protocol).bench.force.latest_n) < 0.004


@pytest.mark.parametrize("protocol", ["openscale", "mantracourt"])
def test_a_cell_whose_samples_gather_while_nobody_presses_is_tared_as_any_other(opened, protocol):
    """They come five at a time then, and each counts."""
    force = opened(20_000.0, protocol=protocol).bench.force
    force.take_time()
    assert abs(force.retare()) < 0.002


def test_a_cell_that_is_plugged_in_after_the_start_is_tared_then(tmp_path):
    """The path is a link, as udev's is: it comes with the amplifier."""
    bridge = EmulatedBridge(lambda _t_s: 20_000.0, noise_counts=40.0, seed=1)
    amplifier = EmulatedOpenScale(bridge)
    path = tmp_path / "force"
    config = simulated_config()
    recorder = tared_once_lifted(config, open_cell(config, str(path)))
    try:
        for asked in (lambda: recorder.latest_n, lambda: recorder.zero_shift_n):
            with pytest.raises(UnpluggedCellError, match=f"{path} cannot be opened"):
                asked()
        path.symlink_to(amplifier.device_path)
        waiting = threading.Event()
        assert any(recorder.fault is None or waiting.wait(0.01) for _ in range(2000))
        assert abs(recorder.latest_n) < 0.004
    finally:
        recorder.close()
        amplifier.close()
