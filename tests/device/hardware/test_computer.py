"""A Raspberry Pi's own files to what the daemon knows of its supply and temperature; any other machine says nothing."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from device.hardware.computer import SysfsComputer
from device.hardware.interfaces import ComputerState

ALARM = "sys/class/hwmon/hwmon2/in0_lcrit_alarm"
TEMPERATURE = "sys/class/thermal/thermal_zone0/temp"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    files = {
        "sys/class/hwmon/hwmon0/name": "cpu_thermal",
        "sys/class/hwmon/hwmon2/name": "rpi_volt",
        ALARM: "0",
        "sys/class/thermal/thermal_zone0/type": "cpu-thermal",
        TEMPERATURE: "48686",
    }
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(content + "\n")
    return tmp_path


def state(root: Path) -> ComputerState:
    return SysfsComputer(lambda: root).read()


def test_a_raspberry_pi_says_its_supply_and_its_temperature(root: Path) -> None:
    assert state(root) == ComputerState(is_supply_low=False, temperature_c=48.686)


def test_a_supply_that_was_too_low_is_told_whatever_the_number_of_its_sensor(root: Path) -> None:
    (root / ALARM).write_text("1\n")
    assert state(root).is_supply_low
    (root / "sys/class/hwmon/hwmon2").rename(root / "sys/class/hwmon/hwmon11")
    assert state(root).is_supply_low


def test_another_machine_says_nothing(tmp_path: Path, root: Path) -> None:
    assert state(tmp_path / "empty") == ComputerState(None, None)
    (root / "sys/class/hwmon/hwmon2/name").write_text("acpitz\n")
    (root / "sys/class/thermal/thermal_zone0/type").write_text("x86_pkg_temp\n")
    assert state(root) == ComputerState(None, None)


@pytest.mark.parametrize("broken", ["", "n/a"])
def test_a_file_that_says_no_number_says_nothing(root: Path, broken: str) -> None:
    (root / ALARM).write_text(broken)
    (root / TEMPERATURE).unlink()
    assert state(root) == ComputerState(None, None)


def test_a_file_that_cannot_be_read_says_nothing(root: Path) -> None:
    (root / TEMPERATURE).unlink()
    (root / TEMPERATURE).mkdir()  # reading it is an OSError, as of a sensor that answers with one
    assert state(root) == ComputerState(is_supply_low=False, temperature_c=None)


def test_a_clock_is_set_by_a_time_server_or_by_a_battery_clock_that_still_agrees(root: Path) -> None:
    """That of a Raspberry Pi 5 without a battery begins in 1970: the kernel began with it, and systemd went on."""
    assert state(root).is_clock_set is None  # no systemd, which would tell
    (root / "run/systemd/system").mkdir(parents=True)
    assert state(root).is_clock_set is False
    clock = root / "sys/class/rtc/rtc0"
    clock.mkdir(parents=True)
    for began_with, since_epoch_s, is_set in (
        ("1", 1000.0, False),
        ("0", time.time(), False),
        ("1", time.time(), True),
    ):
        (clock / "hctosys").write_text(f"{began_with}\n")
        (clock / "since_epoch").write_text(f"{since_epoch_s:.0f}\n")
        assert state(root).is_clock_set is is_set
    (clock / "since_epoch").unlink()
    (root / "run/systemd/timesync").mkdir()
    (root / "run/systemd/timesync/synchronized").touch()
    assert state(root).is_clock_set is True
