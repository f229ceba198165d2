"""The files of a Raspberry Pi that say how its supply, its temperature and its clock are, below a folder of one's own.

As a kernel lays them out: the voltage's alarm in one of several sensors, which are told apart by their `name` alone.
"""

from __future__ import annotations

from pathlib import Path

from device.simulation.faults import FaultTimeline

ORDINARY_C, HOT_C = 52.1, 83.4


class EmulatedComputer:
    """Writes the files below `folder` as the faults of the moment say."""

    def __init__(self, faults: FaultTimeline, folder: Path) -> None:
        self._faults, self._folder = faults, folder
        self._written: dict[str, str] = {}
        self._write("sys/class/hwmon/hwmon0/name", "cpu_thermal")
        self._write("sys/class/hwmon/hwmon1/name", "rpi_volt")
        self._write("sys/class/thermal/thermal_zone0/type", "cpu-thermal")
        (folder / "run/systemd/system").mkdir(parents=True)

    def root(self) -> Path:
        """Return the folder that stands for /, its files brought up to date."""
        temperature_c = HOT_C if self._faults.is_active("computer_hot") else ORDINARY_C
        self._write("sys/class/hwmon/hwmon1/in0_lcrit_alarm", str(int(self._faults.is_active("undervoltage"))))
        self._write("sys/class/thermal/thermal_zone0/temp", str(round(1000 * temperature_c)))
        if not self._faults.is_active("clock_not_set"):
            self._write("run/systemd/timesync/synchronized", "")
        return self._folder

    def _write(self, name: str, content: str) -> None:
        if self._written.get(name) != content:
            path = self._folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content + "\n", encoding="ascii")
            self._written[name] = content
