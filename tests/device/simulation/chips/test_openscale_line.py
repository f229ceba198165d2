"""The emulated amplifier: what a reader of its line sees."""

from __future__ import annotations

import contextlib
import itertools
import os
import re
import threading
import time
from collections.abc import Callable

import numpy as np
import pytest

from device.errors import (
    DetachedCellError,
    LoadCellError,
    SaturatedCellError,
    UnpluggedCellError,
    UnreadableCellError,
)
from device.hardware.load_cell import open_load_cell
from device.hardware.openscale import OpenScale
from device.simulation.chips.emulated_amplifier import MAX_UNREAD_BYTES, EmulatedBridge
from device.simulation.chips.openscale_line import BANNER, EmulatedOpenScale
from device.simulation.faults import NO_FAULTS, FaultTimeline


def streaming(
    counts_at: Callable[[float], float], *, rate_hz: float = 80.0, faults: FaultTimeline = NO_FAULTS, **bridge: float
) -> EmulatedOpenScale:
    return EmulatedOpenScale(EmulatedBridge(counts_at, faults=faults, **bridge), rate_hz=rate_hz, faults=faults)


def read_bytes(path: str, count: int) -> bytes:
    """Return the first bytes of a line, as a reader sees them that does not discard what already waits."""
    line = os.open(path, os.O_RDONLY | os.O_NOCTTY)
    data = b""
    while len(data) < count:
        data += os.read(line, count - len(data))
    os.close(line)
    return data


def readings(data: bytes) -> list[bytes]:
    return data.split(b"Readings:\r\n")[1].split(b"\r\n")


def fault_in(cell: OpenScale) -> LoadCellError | None:
    """Return what a read fails with. On a busy machine any line may come too late and be a silence."""
    try:
        cell.read(timeout_s=0.1)
    except LoadCellError as error:
        return error
    return None


def reached(condition: Callable[[], bool]) -> bool:
    """Wait, at most half a minute, until a condition holds."""
    waiting = threading.Event()
    return any(condition() or waiting.wait(0.005) for _ in range(6000))


def first_reading(cell: OpenScale) -> float:
    """Return the first reading once the line works again: it may take a moment to be back."""
    found: list[float] = []

    def read() -> bool:
        with contextlib.suppress(LoadCellError):
            found.append(cell.read(timeout_s=0.1).counts)
        return bool(found)

    assert reached(read)
    return found[0]


def test_the_banner_comes_first_and_ends_in_readings():
    scale = streaming(lambda _t_s: 42.0, rate_hz=400.0, noise_counts=0.0, seed=1)
    data = read_bytes(scale.device_path, len(BANNER) + 40)
    scale.close()
    assert data.startswith(BANNER)
    assert re.fullmatch(rb"\d+,0\.0004,kg,42,", readings(data)[0])


def test_the_driver_reads_the_counts_of_the_load():
    scale = streaming(lambda _t_s: -12345.0, rate_hz=400.0, noise_counts=0.0, seed=1)
    cell = open_load_cell(scale.device_path)
    samples = [cell.read(timeout_s=30.0) for _ in range(5)]
    assert [sample.counts for sample in samples] == [-12345.0] * 5
    assert [sample.t_s for sample in samples] == sorted(sample.t_s for sample in samples)
    cell.close()
    scale.close()


def test_noise_is_the_same_for_the_same_seed_and_differs_for_another():
    def counts(seed: int) -> list[bytes]:
        scale = streaming(lambda _t_s: 0.0, rate_hz=400.0, noise_counts=1000.0, seed=seed)
        lines = read_bytes(scale.device_path, len(BANNER) + 120)[len(BANNER) :].split(b"\r\n")[:-1]
        scale.close()
        return [line.split(b",")[3] for line in lines]

    first, same, other = counts(1), counts(1), counts(2)
    common = min(len(first), len(same), len(other))
    assert first[:common] == same[:common] != other[:common]


@pytest.mark.parametrize(("load_counts", "raw24"), [(1e9, 8388607), (-1e9, -8388608)])
def test_an_overload_saturates_at_24_bit(load_counts, raw24):
    scale = streaming(lambda _t_s: load_counts, rate_hz=400.0, noise_counts=0.0, seed=1)
    data = read_bytes(scale.device_path, len(BANNER) + 40)
    scale.close()
    assert readings(data)[0].split(b",")[3] == str(raw24).encode()


def test_a_reading_shows_the_load_of_two_conversions_before():
    """As the converter's filter makes it: of a load that grows, by its own clock, from where the amplifier's begins."""
    began_s, asked_s = time.monotonic(), []

    def note(t_s: float) -> float:
        asked_s.append((t_s, time.monotonic()))
        return 1000 * (t_s - began_s)

    scale = streaming(note, rate_hz=200.0, noise_counts=0.0, seed=1)
    read_bytes(scale.device_path, len(BANNER) + 120)
    scale.close()
    assert all(now_s - t_s >= 0.025 for t_s, now_s in asked_s)
    assert min(now_s - t_s for t_s, now_s in asked_s) < 0.03


@pytest.mark.parametrize(("is_offset_binary", "raw24"), [(False, b"-5"), (True, b"8388603")])
def test_both_codings_of_a_reading_are_sent(is_offset_binary, raw24):
    bridge = EmulatedBridge(lambda _t_s: -5.0, noise_counts=0.0, seed=1)
    scale = EmulatedOpenScale(bridge, rate_hz=400.0, is_offset_binary=is_offset_binary)
    data = read_bytes(scale.device_path, len(BANNER) + 40)
    scale.close()
    assert readings(data)[0].split(b",")[3] == raw24


def test_the_zero_drifts_from_the_start_on():
    """10 counts a millisecond, by the amplifier's own time, which its lines round to whole milliseconds."""
    scale = streaming(lambda _t_s: 1000.0, rate_hz=200.0, noise_counts=0.0, drift_counts_per_s=10_000.0, seed=1)
    lines = readings(read_bytes(scale.device_path, len(BANNER) + 120))[:-1]
    scale.close()
    since_power_ms, counts = (np.array([int(line.split(b",")[field]) for line in lines]) for field in (0, 3))
    assert counts[-1] - counts[0] > 100
    np.testing.assert_allclose(counts - counts[0], 10 * (since_power_ms - since_power_ms[0]), atol=11)
    assert counts[0] >= 1000 - 250  # of two conversions before its start


class Switch:
    """A fault that a test switches on and off."""

    def __init__(self, kind: str) -> None:
        self.kind, self.is_on = kind, False

    def is_active(self, kind: str, t_s: float | None = None) -> bool:
        return self.is_on and kind == self.kind


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
def test_a_fault_shows_in_the_bytes_and_is_over_when_it_is_over(kind, error):
    fault = Switch(kind)
    scale = streaming(lambda _t_s: 42.0, rate_hz=400.0, noise_counts=0.0, seed=1, faults=fault)
    cell = open_load_cell(scale.device_path)
    assert cell.read(timeout_s=30.0).counts == 42.0
    fault.is_on = True
    assert reached(lambda: type(fault_in(cell)) is error)
    fault.is_on = False
    assert first_reading(cell) == 42.0
    cell.close()
    scale.close()


def test_an_overload_adds_to_the_load_and_is_no_end_of_the_range():
    fault = Switch("cell_overloaded")
    fault.is_on = True
    scale = streaming(lambda _t_s: 42.0, rate_hz=400.0, noise_counts=0.0, seed=1, faults=fault)
    data = read_bytes(scale.device_path, len(BANNER) + 40)
    scale.close()
    assert readings(data)[0].split(b",")[3] == b"2097194"


def test_unplugging_takes_the_path_away_and_plugging_in_again_brings_a_banner():
    fault = Switch("cell_unplugged")
    fault.is_on = True
    scale = streaming(lambda _t_s: 42.0, rate_hz=400.0, noise_counts=0.0, seed=1, faults=fault)
    assert reached(lambda: not os.path.exists(scale.device_path))
    fault.is_on = False
    assert reached(lambda: os.path.exists(scale.device_path))
    assert read_bytes(scale.device_path, len(BANNER)).startswith(BANNER)
    scale.close()


def test_lines_that_nobody_reads_are_lost_not_kept():
    """Of some 14 kB about as much is kept as may be unread: the kernel counts a line only when it has passed it on."""
    enough_sent = threading.Event()
    asked = itertools.count()

    def count_up(_t_s: float) -> float:
        number = next(asked)
        if number == 500:
            enough_sent.set()
        return float(number)

    with contextlib.closing(streaming(count_up, rate_hz=2000.0, noise_counts=0.0, seed=1)) as scale:
        assert enough_sent.wait(60.0)
        line = os.open(scale.device_path, os.O_RDONLY | os.O_NOCTTY)
        assert len(os.read(line, 65536)) <= 4 * MAX_UNREAD_BYTES
        os.close(line)


def test_closing_is_unplugging_for_the_reader_and_ends_the_thread():
    scale = streaming(lambda _t_s: 0.0, noise_counts=0.0, seed=1)
    cell = open_load_cell(scale.device_path)
    scale.close()
    scale.close()
    assert reached(lambda: "is gone" in str(fault_in(cell)))
    cell.close()
    assert "load cell stream" not in {thread.name for thread in threading.enumerate()}
