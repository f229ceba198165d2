"""The unit files, read by systemd itself, which only complains in words about a key or value that it does not know.

`make test-systemd` runs them.
"""

from __future__ import annotations

import configparser
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from daemon_process import ROOT

from device.fallback.server import GIVEN_UP_S
from device.files.start_note import NOTE
from device.instrument.watch.watchdog import WITHOUT_SYSTEMD_S
from device.settings.catalogue import SETTINGS
from host_tools.release.target import SYSTEMS

FOLDER = ROOT / "systemd"
UNIT = FOLDER / "tsis.service"
FALLBACK = FOLDER / "tsis-fallback.service"
UNITS = sorted(path for kind in ("service", "path") for path in FOLDER.glob(f"*.{kind}"))
RULES = FOLDER / "tsis-force.rules"
LIGHT_RULES = FOLDER / "tsis-light.rules"
PYTHON = "/opt/tsis/current/bin/python"
PROGRAMS = re.compile(r"/opt/tsis/(?:current|updater)/bin/python|/usr/bin/(?:cage|chromium)")
"""What is on a probe and not here; systemd looks whether the program of a line is there."""
MOST_EXPOSED = {
    "tsis.service": 1.5,
    "tsis-fallback.service": 1.5,
    "tsis-boot.service": 1.5,
    "tsis-update.service": 2.0,
    "tsis-kiosk.service": 4.5,
}
"""systemd's own score: 10 is exposed, 2 is well shut in. The installer is root and asks the probe how it is, by
loopback; a browser writes code that it runs and makes name spaces for its own sandbox."""
INCOMING = "/var/lib/tsis-update/incoming"
needs_systemd = pytest.mark.skipif(
    not shutil.which("systemd-analyze") and "TSIS_REQUIRE_PEERS" not in os.environ,  # there its absence is a failure
    reason="systemd-analyze is not installed (Debian: systemd)",
)


def udev_version() -> int:
    if not shutil.which("udevadm"):
        return 0
    return int(subprocess.run(["udevadm", "--version"], capture_output=True, text=True, check=True).stdout.split()[0])


def here(folder: Path, changed: str = "", to: str = "") -> Path:
    """Copy all units, as they would be if this interpreter were what they run; return tsis.service, changed."""
    for path in UNITS:
        (folder / path.name).write_text(PROGRAMS.sub(sys.executable, path.read_text()))
    unit = folder / UNIT.name
    unit.write_text(unit.read_text().replace(changed, to))
    return unit


def complaints(path: Path) -> str:
    command = ["systemd-analyze", "verify", "--man=no", str(path)]
    return subprocess.run(command, capture_output=True, text=True, check=False).stderr


@needs_systemd
@pytest.mark.parametrize("unit", UNITS, ids=lambda path: path.name)
def test_systemd_takes_every_line_of_the_unit(tmp_path, unit):
    assert complaints(here(tmp_path).with_name(unit.name)) == ""


@needs_systemd
@pytest.mark.parametrize(("line", "wrong"), [("WatchdogSec=15", "WatchdogSec=soon"), ("UMask=", "UMusk=")])
def test_a_line_that_systemd_does_not_take_is_told(tmp_path, line, wrong):
    assert line in UNIT.read_text()
    assert complaints(here(tmp_path, line, wrong))


@needs_systemd
@pytest.mark.parametrize("name", MOST_EXPOSED)
def test_the_unit_shuts_its_program_in(tmp_path, name):
    threshold = f"--threshold={10 * MOST_EXPOSED[name]:.0f}"
    command = ["systemd-analyze", "security", "--offline=true", threshold, "--no-pager"]
    path = here(tmp_path).with_name(name)
    verified = subprocess.run([*command, str(path)], capture_output=True, text=True, check=False)
    assert verified.returncode == 0, verified.stdout


def test_the_fallback_runs_from_the_last_good_release_by_the_systems_python_alone():
    service = service_of(FALLBACK)
    assert service["ExecStart"].split() == ["/usr/bin/python3", "-S", "-P", "-m", "device.fallback"]
    assert int(service["WatchdogSec"]) > 2 * GIVEN_UP_S


def test_the_daemon_notes_where_the_fallback_reads_and_what_it_noted_stays():
    service = service_of(UNIT)
    assert f"run/{service['RuntimeDirectory']}" == str(Path(NOTE).parent)
    assert service["RuntimeDirectoryPreserve"] == "yes"
    assert service["User"] == service_of(FALLBACK)["User"]


def section_of(path: Path, name: str) -> configparser.SectionProxy:
    """Return a section; of a key with several lines the last one."""
    unit = configparser.RawConfigParser(strict=False)
    unit.optionxform = str
    unit.read_string(path.read_text().replace("\\\n", ""))
    return unit[name]


def service_of(path: Path) -> configparser.SectionProxy:
    return section_of(path, "Service")


def test_a_unit_that_begins_waits_for_no_network():
    """A hospital's network may be down for hours; network.target only orders the stop."""
    asked = [line for path in UNITS for line in path.read_text().splitlines() if "network-online" in line]
    assert asked == []


@pytest.mark.parametrize("unit", [path for path in UNITS if path.suffix == ".service"], ids=lambda path: path.name)
def test_a_unit_has_limits_of_memory_and_tasks_where_they_would_hold(unit):
    """A session by PAM is a control group of its own: there the browser is what the kernel ends first."""
    service = service_of(unit)
    limits = {"OOMScoreAdjust"} if "PAMName" in service else {"MemoryMax", "TasksMax"}
    assert limits <= set(service)


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


def test_the_daemon_can_write_its_state_its_note_in_memory_and_lay_a_release_ready_and_nothing_else():
    """systemd 252 gives a ConfigurationDirectory= to the unit's user, who could then write the settings."""
    service = service_of(UNIT)
    assert service["ProtectSystem"] == "strict"
    assert service["StateDirectory"] == "tsis"
    others = ("Configuration", "Cache", "Logs")
    assert not {*(f"{kind}Directory" for kind in others), "BindPaths"} & set(service)
    assert service["ReadWritePaths"] == f"-{INCOMING}"


def made(kind: str) -> dict[str, list[str]]:
    """Return lines of tsis.sysusers.conf by their name: u users, g groups, m memberships."""
    found: dict[str, list[str]] = {}
    for line in (FOLDER / "tsis.sysusers.conf").read_text().splitlines():
        if (words := line.split()) and words[0] == kind:
            found.setdefault(words[1], []).extend(words[2:])
    return found


def test_what_is_run_by_hand_as_the_daemons_user_reaches_the_hardware_as_the_unit_does():
    """`sudo -u tsis ... record` has no unit's groups: without these no probe could be calibrated."""
    asked = service_of(UNIT)["SupplementaryGroups"].split()
    assert set(made("m")["tsis"]) == {*asked, "tsis-update"}


def test_no_unit_runs_code_that_lies_where_the_daemon_writes():
    """`python -m` looks first into the folder that it stands in, and then into its user's home: the data folder."""
    service = service_of(UNIT)
    assert service["WorkingDirectory"] == "/var/lib/tsis"
    assert service["Environment"].split() == ["PYTHONSAFEPATH=1", "PYTHONNOUSERSITE=1"]
    assert "PYTHONNOUSERSITE=1" in service_of(FALLBACK)["Environment"].split()  # of what it starts
    others = [service_of(path) for path in UNITS if path.suffix == ".service" and path != UNIT]
    assert not [one for one in others if "WorkingDirectory" in one and "python" in one["ExecStart"]]


def test_what_lies_in_the_data_folder_is_not_run(tmp_path):
    """By the unit's own environment, in a folder as the data folder may be; without it all three would be run."""
    packages = tmp_path / f".local/lib/python{sys.version_info[0]}.{sys.version_info[1]}/site-packages"
    packages.mkdir(parents=True)
    (tmp_path / "device").mkdir()
    for place in (tmp_path / "device/__init__.py", packages / "usercustomize.py"):
        place.write_text("print('foreign')")
    (packages / "foreign.pth").write_text("import sys; print('foreign')\n")
    command = [sys.executable, "-c", "import device; print(device.__file__)"]
    stated = dict(word.split("=") for word in service_of(UNIT)["Environment"].split())
    outside = {"HOME": str(tmp_path), "PATH": os.environ["PATH"]}
    said = [
        subprocess.run(command, cwd=tmp_path, env=outside | added, capture_output=True, text=True, check=True).stdout
        for added in (stated, {})
    ]
    assert said[0].splitlines() == [str(ROOT / "device/__init__.py")]
    assert "foreign" in said[1]


def test_the_fallback_finds_the_release_of_every_system():
    [path] = re.findall(r"PYTHONPATH=(\S+)", service_of(FALLBACK)["Environment"])
    assert path.split(":") == [f"/opt/tsis/updater/lib/python{one.python}/site-packages" for one in SYSTEMS.values()]


def test_a_group_that_debian_does_not_always_have_is_made_for_the_unit():
    asked = set(service_of(UNIT)["SupplementaryGroups"].split())
    assert asked - {"video", "dialout"} == set(made("g")) - {"tsis-update"}


def test_those_who_bring_a_release_file_may_write_where_it_is_expected():
    """The REST API as tsis, ssh as tsis-deploy; the folder is made before anything starts."""
    assert "tsis-update" in made("m")["tsis"]
    assert made("m")["tsis-deploy"] == ["tsis-update"]
    [line] = [one for one in (FOLDER / "tsis.tmpfiles.conf").read_text().splitlines() if f" {INCOMING} " in one]
    assert line.split() == ["d", INCOMING, "0770", "root", "tsis-update", "-"]
    assert f"PathExists={INCOMING}/update.release" in (FOLDER / "tsis-update.path").read_text().splitlines()


@needs_systemd
def test_what_a_screen_of_before_has_saved_goes_at_the_next_boot_and_nothing_else(tmp_path):
    own = tmp_path / "var/lib/tsis-screen"
    for name in ("Downloads/report.pdf", "kept"):
        (own / name).parent.mkdir(parents=True, exist_ok=True)
        (own / name).touch()
    lines = (FOLDER / "tsis.tmpfiles.conf").read_text().splitlines()
    removed = tmp_path / "removed.conf"
    removed.write_text("\n".join(one for one in lines if one.startswith("R")))
    command = ["systemd-tmpfiles", "--remove", f"--root={tmp_path}", removed]
    subprocess.run(command, check=True)
    assert (own / "Downloads/report.pdf").exists(), "not while the probe runs"
    subprocess.run([*command, "--boot"], check=True)
    assert [one.name for one in own.iterdir()] == ["kept"]


def test_every_user_of_a_unit_is_made():
    users = {service_of(path).get("User", "root") for path in UNITS if path.suffix == ".service"}
    assert users - {"root"} <= set(made("u"))


def test_the_probe_starts_after_the_boot_check_and_also_without_it():
    assert "tsis.service" in section_of(FOLDER / "tsis-boot.service", "Unit")["Before"].split()
    unit = section_of(UNIT, "Unit")
    assert not {"Requires", "BindsTo", "Requisite"} & set(unit)


def test_the_updater_runs_from_the_release_that_has_proved_itself():
    for name in ("tsis-boot.service", "tsis-update.service"):
        assert service_of(FOLDER / name)["ExecStart"].startswith("/opt/tsis/updater/bin/python -m device.update ")


def test_the_screen_shows_the_page_of_this_machine_and_comes_back():
    service = service_of(FOLDER / "tsis-kiosk.service")
    assert f" http://127.0.0.1:{SETTINGS['server.port'].default}/" in service["ExecStart"]
    assert service["Restart"] == "always"
    assert service["User"] == "tsis-screen"


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
