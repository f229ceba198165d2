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
    fine = ComputerState(is_supply_low=False, temperature_c=ORDINARY_C)
    low, hot = ComputerState(True, ORDINARY_C), ComputerState(False, HOT_C)
    assert seen == [fine, low, fine, hot, fine]
