"""Supply voltage, temperature and clock of a Raspberry Pi, from the files in which its system says them.

The kernel asks the firmware every two seconds whether the voltage was too low since the last time, which clears the
firmware's flag, and keeps the answer in `in0_lcrit_alarm` of the sensor `rpi_volt`: reading it asks nobody and cannot
hang. Source: Linux, drivers/hwmon/raspberrypi-hwmon.c and Documentation/hwmon/raspberrypi-hwmon.rst.

Not used: `soc:firmware/get_throttled`, which older kernels answer with a backtrace in their log and which is gone since
March 2025 (raspberrypi/linux pull request 6697); and /dev/vcio, by which a program may ask the firmware for much more
than this. So that the processor was slowed down is told from its temperature.

A Raspberry Pi 4 has no clock of its own while it is off: it goes on at the time at which systemd last wrote it down,
days or months ago, until a time server answers. A battery clock is believed where the kernel began with it and it
still agrees: one without a battery (Raspberry Pi 5) begins in 1970. Sources: systemd-timesyncd.service(8), "Files";
Linux, Documentation/ABI/testing/sysfs-class-rtc (`hctosys`, `since_epoch`); sd_booted(3).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from device.hardware.interfaces import ComputerState

VOLTAGE_SENSOR, ALARM = "rpi_volt", "in0_lcrit_alarm"
PROCESSOR_ZONE = "cpu-thermal"
"""Type of the thermal zone; other machines have other zones, which say nothing of a Raspberry Pi."""
SYSTEMD, SYNCHRONISED = "run/systemd/system", "run/systemd/timesync/synchronized"
"""There where systemd runs; made once a time server has set the clock. Other time services do not make it."""
AGREEING_S = 60.0
"""A battery clock that is further off than this has stopped, or the clock was set since."""


def _system_root() -> Path:
    return Path("/")


class SysfsComputer:
    """The computer below a root folder, which is asked for at each reading. Implements `Computer`."""

    def __init__(self, root: Callable[[], Path] = _system_root) -> None:
        self._root = root

    def read(self) -> ComputerState:
        """Return what the files say now; a file that is missing or cannot be read says nothing."""
        root = self._root()
        alarm = _first(root, "sys/class/hwmon/hwmon*", "name", VOLTAGE_SENSOR, ALARM)
        millidegrees = _first(root, "sys/class/thermal/thermal_zone*", "type", PROCESSOR_ZONE, "temp")
        return ComputerState(
            is_supply_low=None if alarm is None else alarm != 0,
            temperature_c=None if millidegrees is None else millidegrees / 1000,
            is_clock_set=_is_clock_set(root),
        )


def _is_clock_set(root: Path) -> bool | None:
    """Return None where there is no systemd, which would tell."""
    if (root / SYNCHRONISED).exists():
        return True
    if not (root / SYSTEMD).exists():
        return None
    since_epoch_s = _first(root, "sys/class/rtc/rtc*", "hctosys", "1", "since_epoch")
    return since_epoch_s is not None and abs(since_epoch_s - time.time()) < AGREEING_S


def _first(root: Path, folders: str, label: str, wanted: str, file: str) -> int | None:
    """Return the number in a file of the first folder whose label is as wanted, None without one."""
    for folder in sorted(root.glob(folders)):
        if _text(folder / label) == wanted:
            try:
                return int(_text(folder / file))
            except ValueError:
                return None
    return None


def _text(path: Path) -> str:
    """Return a file's content, empty for one that cannot be read: a driver may answer with an error."""
    try:
        return path.read_text(encoding="ascii", errors="replace").strip()
    except OSError:
        return ""
