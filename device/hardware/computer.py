"""Supply voltage and temperature of a Raspberry Pi, from the files in which its kernel says them.

The kernel asks the firmware every two seconds whether the voltage was too low since the last time, which clears the
firmware's flag, and keeps the answer in `in0_lcrit_alarm` of the sensor `rpi_volt`: reading it asks nobody and cannot
hang. Source: Linux, drivers/hwmon/raspberrypi-hwmon.c and Documentation/hwmon/raspberrypi-hwmon.rst.

Not used: `soc:firmware/get_throttled`, which older kernels answer with a backtrace in their log and which is gone since
March 2025 (raspberrypi/linux pull request 6697); and /dev/vcio, by which a program may ask the firmware for much more
than this. So that the processor was slowed down is told from its temperature.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from device.hardware.interfaces import ComputerState

VOLTAGE_SENSOR, ALARM = "rpi_volt", "in0_lcrit_alarm"
PROCESSOR_ZONE = "cpu-thermal"
"""Type of the thermal zone; other machines have other zones, which say nothing of a Raspberry Pi."""


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
        )


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
