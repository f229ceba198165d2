"""The emulated files are read by the driver of the real ones, while a fault is there and after it."""

from __future__ import annotations

from pathlib import Path

from device.hardware.computer import SysfsComputer
from device.hardware.interfaces import ComputerState
from device.simulation.chips.emulated_computer import HOT_C, ORDINARY_C, EmulatedComputer
from device.simulation.faults import FaultTimeline, ScriptedFault


def test_the_driver_reads_each_fault_and_its_end(tmp_path: Path) -> None:
    now_s = [0.0]
    faults = (ScriptedFault("undervoltage", 1.0, 2.0), ScriptedFault("computer_hot", 3.0, 4.0))
    emulated = EmulatedComputer(FaultTimeline(faults, clock=lambda: now_s[0]), tmp_path)
    computer, seen = SysfsComputer(emulated.root), []
    for now_s[0] in (0.0, 1.5, 2.5, 3.5, 4.5):
        seen.append(computer.read())
    fine = ComputerState(is_supply_low=False, temperature_c=ORDINARY_C, is_clock_set=True)
    low, hot = ComputerState(True, ORDINARY_C, True), ComputerState(False, HOT_C, True)
    assert seen == [fine, low, fine, hot, fine]


def test_a_clock_is_set_once_a_time_server_has_answered(tmp_path: Path) -> None:
    now_s = [0.0]
    faults = FaultTimeline((ScriptedFault("clock_not_set", until_s=1.0),), clock=lambda: now_s[0])
    computer, seen = SysfsComputer(EmulatedComputer(faults, tmp_path).root), []
    for now_s[0] in (0.0, 1.5):
        seen.append(computer.read().is_clock_set)
    assert seen == [False, True]
