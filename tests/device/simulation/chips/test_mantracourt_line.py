"""The emulated Mantracourt unit: what it replies to whom, and that the driver takes it for one."""

from __future__ import annotations

import os
import select
import threading
from collections.abc import Callable

import pytest

from device.errors import (
    DetachedCellError,
    LoadCellError,
    SaturatedCellError,
    UnpluggedCellError,
    UnreadableCellError,
)
from device.hardware import mantracourt
from device.hardware.load_cell import open_load_cell
from device.hardware.mantracourt import Mantracourt
from device.simulation.chips.emulated_amplifier import EmulatedBridge
from device.simulation.chips.mantracourt_line import EmulatedMantracourt


class Switch:
    """A fault that a test switches on and off."""

    def __init__(self, kind: str = "") -> None:
        self.kind, self.is_on = kind, False

    def is_active(self, kind: str, t_s: float | None = None) -> bool:
        return self.is_on and kind == self.kind


@pytest.fixture
def unit_of():
    units: list[EmulatedMantracourt] = []

    def unit(counts: float, fault: Switch | None = None, station: int = 1) -> EmulatedMantracourt:
        fault = fault or Switch()
        bridge = EmulatedBridge(lambda _t_s: counts, noise_counts=0.0, seed=1, faults=fault)
        units.append(EmulatedMantracourt(bridge, station=station, faults=fault))
        return units[-1]

    yield unit
    for one in units:
        one.close()


def reply(unit: EmulatedMantracourt, request: bytes) -> bytes:
    """Return what comes back within 0.1 s."""
    line = os.open(unit.device_path, os.O_RDWR | os.O_NOCTTY)
    os.write(line, request)
    data = b""
    while not data.endswith(b"\r") and select.select([line], [], [], 0.1)[0]:
        data += os.read(line, 100)
    os.close(line)
    return data


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        (b"!001:MVV?\r", b"+00000.008200\r"),
        (b"!001:mvv?\r", b"+00000.008200\r"),
        (b"!001:STAT?\r", b"+00000.000000\r"),
        (b"\xff\x00!001:MVV?\r", b"+00000.008200\r"),
        (b"!001:NONE?\r", b"?\r"),
        (b"!002:MVV?\r", b""),
        (b"!000:MVV?\r", b""),
        (b"!001:MVV?", b""),
        (b"001:MVV?\r", b""),
    ],
)
def test_a_request_to_its_station_is_answered_and_no_other(unit_of, request_, answer):
    assert reply(unit_of(8200.0), request_) == answer


@pytest.mark.parametrize(("counts", "value", "flags"), [(4e6, b"+00003", b"+00032"), (-4e6, b"-00003", b"+00016")])
def test_beyond_its_range_it_gives_the_end_and_a_flag(unit_of, counts, value, flags):
    unit = unit_of(counts)
    assert reply(unit, b"!001:MVV?\r") == value + b".000000\r"
    assert reply(unit, b"!001:STAT?\r") == flags + b".000000\r"


def test_the_driver_reads_the_counts_of_the_load(unit_of):
    cell = open_load_cell(unit_of(-12_345.0, station=7).device_path, 115_200, "mantracourt", 7)
    samples = [cell.read(timeout_s=30.0) for _ in range(5)]
    assert [sample.counts for sample in samples] == pytest.approx([-12_345.0] * 5)
    assert [sample.t_s for sample in samples] == sorted(sample.t_s for sample in samples)
    cell.close()


def fault_in(cell: Mantracourt) -> type[LoadCellError] | None:
    """Return what a read fails with. On a busy machine any may come too late and be a silence."""
    try:
        assert cell.read(timeout_s=0.1).counts == pytest.approx(42.0)
    except LoadCellError as error:
        return type(error)
    return None


def reached(condition: Callable[[], bool]) -> bool:
    """Wait, at most half a minute, until a condition holds."""
    waiting = threading.Event()
    return any(condition() or waiting.wait(0.005) for _ in range(6000))


@pytest.mark.parametrize(
    ("kind", "error"),
    [
        ("cell_silent", LoadCellError),
        ("cell_garbage", UnreadableCellError),
        ("cell_saturated", SaturatedCellError),
        ("cell_disconnected", DetachedCellError),
        ("cell_unplugged", UnpluggedCellError),
    ],
)
def test_a_fault_shows_in_the_replies_and_is_over_when_it_is_over(unit_of, kind, error, monkeypatch):
    monkeypatch.setattr(mantracourt, "REPLY_S", 0.1)
    fault = Switch(kind)
    cell = open_load_cell(unit_of(42.0, fault).device_path, 115_200, "mantracourt")
    assert reached(lambda: fault_in(cell) is None)
    fault.is_on = True
    assert reached(lambda: fault_in(cell) is error)
    fault.is_on = False
    assert reached(lambda: fault_in(cell) is None)
    cell.close()


def test_a_reading_takes_the_time_of_its_bytes(unit_of):
    """The 49 bytes of two requests and replies take 51 ms at 9600 baud."""
    cell = open_load_cell(unit_of(250_000.0).device_path, 9600, "mantracourt", 1)
    samples = [cell.read(timeout_s=5.0) for _ in range(5)]
    cell.close()
    assert (samples[-1].t_s - samples[0].t_s) / 4 > 0.05
