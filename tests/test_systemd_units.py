"""The unit files, read by systemd itself, which only complains in words about a key or value that it does not know.

`make test-systemd` runs them.
"""

from __future__ import annotations

import configparser
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from daemon_process import ROOT

from device.instrument.watch.watchdog import WITHOUT_SYSTEMD_S
from device.settings.catalogue import SETTINGS

UNIT = ROOT / "systemd" / "tsis.service"
RULES = ROOT / "systemd" / "tsis-force.rules"
LIGHT_RULES = ROOT / "systemd" / "tsis-light.rules"
PYTHON = "/opt/tsis/current/bin/python"
needs_systemd = pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="systemd-analyze is not installed")


def udev_version() -> int:
    if not shutil.which("udevadm"):
        return 0
    return int(subprocess.run(["udevadm", "--version"], capture_output=True, text=True, check=True).stdout.split()[0])


def here(folder: Path, text: str) -> Path:
    """Return the unit as it would be if this interpreter were the installed one."""
    path = folder / UNIT.name
    path.write_text(text.replace(PYTHON, sys.executable))
    return path


def complaints(path: Path) -> str:
    return subprocess.run(["systemd-analyze", "verify", str(path)], capture_output=True, text=True, check=False).stderr


@needs_systemd
def test_systemd_takes_every_line_of_the_unit(tmp_path):
    assert complaints(here(tmp_path, UNIT.read_text())) == ""


@needs_systemd
@pytest.mark.parametrize(("line", "wrong"), [("WatchdogSec=15", "WatchdogSec=soon"), ("UMask=", "UMusk=")])
def test_a_line_that_systemd_does_not_take_is_told(tmp_path, line, wrong):
    assert line in UNIT.read_text()
    assert complaints(here(tmp_path, UNIT.read_text().replace(line, wrong)))


@needs_systemd
def test_the_unit_shuts_the_daemon_in(tmp_path):
    """systemd's own score: 10 is exposed, 2 is well shut in; the threshold is in tenths."""
    command = ["systemd-analyze", "security", "--offline=true", "--threshold=20", "--no-pager"]
    path = here(tmp_path, UNIT.read_text())
    verified = subprocess.run([*command, str(path)], capture_output=True, text=True, check=False)
    assert verified.returncode == 0, verified.stdout


def section_of(path: Path, name: str) -> configparser.SectionProxy:
    unit = configparser.RawConfigParser(strict=False)
    unit.optionxform = str
    unit.read(path)
    return unit[name]


def service_of(path: Path) -> configparser.SectionProxy:
    return section_of(path, "Service")


@pytest.mark.parametrize("driver", ["usbserial", "cdc_acm"])
def test_a_load_cell_that_is_plugged_in_later_finds_its_driver_loaded_before_the_daemon(driver):
    unit = section_of(UNIT, "Unit")
    assert f"modprobe@{driver}.service" in unit["Wants"].split()
    assert f"modprobe@{driver}.service" in unit["After"].split()


def test_the_unit_asks_for_the_watchdogs_time_and_darkens_the_light_after_any_end():
    service = service_of(UNIT)
    assert service["Type"] == "notify"
    assert float(service["WatchdogSec"]) == WITHOUT_SYSTEMD_S
    assert service["ExecStart"] == f"{PYTHON} -m device"
    assert service["ExecStopPost"] == f"-{PYTHON} -m device.commands.led_off"
    assert service["Restart"] == "on-failure"


def test_the_daemon_can_write_its_state_and_nothing_else():
    """systemd 252 gives a ConfigurationDirectory= to the unit's user, who could then write the settings."""
    service = service_of(UNIT)
    assert service["ProtectSystem"] == "strict"
    assert service["StateDirectory"] == "tsis"
    others = ("Configuration", "Cache", "Logs", "Runtime")
    assert not {*(f"{kind}Directory" for kind in others), "ReadWritePaths", "BindPaths"} & set(service)


def test_a_group_that_debian_does_not_always_have_is_made_for_the_unit():
    made = re.findall("^g ([a-z0-9]+) ", (UNIT.parent / "tsis.sysusers.conf").read_text(), re.MULTILINE)
    assert set(service_of(UNIT)["SupplementaryGroups"].split()) == {"video", "dialout", *made}


def test_the_group_that_may_drive_the_enable_line_is_one_of_the_units():
    [line] = [line for line in LIGHT_RULES.read_text().splitlines() if line and not line.startswith("#")]
    [group] = re.findall(r'GROUP="(.*?)"', line)
    assert group in service_of(UNIT)["SupplementaryGroups"].split()
    assert "DeviceAllow=char-gpiochip rw" in UNIT.read_text()


def test_the_unit_that_is_run_under_a_real_systemd_differs_only_in_its_hardware():
    simulated = service_of(ROOT / "tests" / "systemd" / "simulated.conf")
    assert set(simulated) == {"ExecStart", "Environment"}
    assert "--simulate" in simulated["ExecStart"]


def test_the_rule_names_the_load_cell_as_the_settings_do():
    [line] = [line for line in RULES.read_text().splitlines() if line and not line.startswith("#")]
    assert re.findall(r'SYMLINK\+="(.*?)"', line) == [SETTINGS["cell.device"].default.removeprefix("/dev/")]


@pytest.mark.skipif(udev_version() < 254, reason="no udevadm that verifies (systemd 254)")
@pytest.mark.parametrize("rules", [RULES, LIGHT_RULES], ids=lambda path: path.name)
def test_udev_takes_the_rule(rules):
    verified = subprocess.run(["udevadm", "verify", str(rules)], capture_output=True, text=True, check=False)
    assert verified.returncode == 0, verified.stderr
