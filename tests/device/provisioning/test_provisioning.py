"""A fresh machine, as a folder with fakes of its commands, becomes a probe; applied again, nothing is done.

`make test-deploy` does the same to a Debian that has booted.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from daemon_process import ROOT
from small_release import new_key, release_file

from device.errors import CameraError, ModelError
from device.files.start_note import NOTE, write_note
from device.files.toml_record import read_table
from device.provisioning.__main__ import REBOOT, main
from device.provisioning.installation import unit_links

KEY = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAICOVbraQn3kK1Wb0N2xWvJZkqYJm7yQ8dX0g0eVwq1aB"
SIGNER = f"release@tsis {KEY} maker\n"
CONFIG, KERNEL_LINE = "boot/firmware/config.txt", "boot/firmware/cmdline.txt"
FAKES = {
    "apt-get": 'echo "$@" >> "$ROOT/asked"; while [ $# -gt 0 ]; do case $1 in install) shift 3; '
    'for name; do echo "$name installed"; done >> "$ROOT/packages";; esac; shift; done',
    "dpkg-query": 'cat "$ROOT/packages" 2> /dev/null; exit 1',
    "systemd-sysusers": f'exec {sys.executable} {Path(__file__).with_name("fake_sysusers.py")} "$ROOT"',
    "systemd-tmpfiles": 'while read -r kind path mode rest; do [ "$kind" != d ] || '
    '{ mkdir -p "$ROOT$path"; chmod "$mode" "$ROOT$path"; }; done',
    "systemctl": 'echo "systemctl $*" >> "$ROOT/asked"; case $1 in is-active) cat "$ROOT/active" 2> /dev/null;; '
    'start) printf "active\\nactive\\nactive\\n" > "$ROOT/active"; if [ -e "$ROOT/run/tsis/start.json" ]; then '
    'printf "activating\\nactive\\nactive\\n" > "$ROOT/active"; case $* in *tsis.service*) exit 1;; esac; fi;; esac; '
    "true",
    "sshd": 'echo "sshd $*" >> "$ROOT/asked"',
    "udevadm": 'echo "udevadm $*" >> "$ROOT/asked"; exit 1',
}


class FreshMachine:
    """A folder that stands for /, and a command line that makes it a probe."""

    def __init__(self, root: Path) -> None:
        self.root = root
        for file, text in {
            "etc/passwd": "root:x:0:0::/root:/bin/sh\n",
            "etc/group": "root:x:0:\nvideo:x:44:\n",
            "etc/fstab": "PARTUUID=0-01 /boot/firmware vfat defaults 0 2\nPARTUUID=0-02 / ext4 defaults,noatime 0 1\n",
            "home/pi/.ssh/authorized_keys": f"{KEY} pi\n",
            "usr/share/zoneinfo/Europe/Berlin": "",
            CONFIG: "[pi5]\ndtparam=ant2\n",
            KERNEL_LINE: "console=tty1 rootwait\n",
            "key.pub": f"{KEY} who@where\n",
            "signers": SIGNER,
        }.items():
            (root / file).parent.mkdir(parents=True, exist_ok=True)
            (root / file).write_text(text)

    def text(self, file: str) -> str:
        return (self.root / file).read_text()

    def asked(self) -> str:
        return self.text("asked") if (self.root / "asked").exists() else ""

    def run(self, *options: str, serial: str = "TSIS-0007") -> int:
        named = ["--signers", f"{self.root}/signers", "--deploy-key", f"{self.root}/key.pub", "--serial", serial]
        return main([*named, "--release", "new.release", "--root", str(self.root), *options])

    def check(self, *options: str) -> int:
        return main(["--check", "--root", str(self.root), *options])

    def install_a_release(self) -> None:
        """As device.update would have done."""
        release = self.root / "opt/tsis/releases/0.2.0+412"
        release.mkdir(parents=True)
        (release / "manifest.json").touch()
        (release / "bin").mkdir()
        (release / "bin/python").write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
        (release / "bin/python").chmod(0o755)
        for link in ("current", "updater"):
            (self.root / "opt/tsis" / link).symlink_to("releases/0.2.0+412")


@pytest.fixture
def machine(tmp_path, monkeypatch) -> FreshMachine:
    root, commands = tmp_path / "root", tmp_path / "bin"
    commands.mkdir()
    for name, script in FAKES.items():
        (commands / name).write_text(f"#!/bin/sh\n{script}\n")
        (commands / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{commands}:{os.environ['PATH']}")
    monkeypatch.setenv("ROOT", str(root))
    return FreshMachine(root)


@pytest.fixture
def probe(machine: FreshMachine) -> FreshMachine:
    assert machine.run("--time-zone", "Europe/Berlin") == REBOOT
    machine.install_a_release()
    assert machine.run() == 0
    return machine


def test_a_fresh_machine_becomes_a_probe_and_then_differs_in_nothing(probe, capsys):
    capsys.readouterr()
    assert probe.check("--serial", "TSIS-0007", "--time-zone", "Europe/Berlin") == 0
    assert capsys.readouterr().out == ""


def test_a_probe_whose_parts_are_not_wired_yet_is_made_and_says_what_is_missing(probe, capsys):
    """`systemctl start` fails where the daemon ends with 1; the rest goes all the same."""
    (probe.root / NOTE).parent.mkdir(parents=True)
    write_note(probe.root, [CameraError("No camera at index 0.", "Plug it in.").as_record()])
    (probe.root / "active").unlink()
    capsys.readouterr()
    assert probe.run("--time-zone", "Europe/Berlin") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-2] == "next       its daemon does not start yet: E101 No camera at index 0. Plug it in."
    assert "E402" in lines[-1]
    assert probe.asked().splitlines()[-2] == "systemctl start --no-block tsis-kiosk.service"
    assert probe.check() == 1
    assert capsys.readouterr().out == "lacks      E101 No camera at index 0. Plug it in.\n"


def test_a_daemon_that_does_not_start_for_its_own_sake_is_a_difference(probe, capsys):
    (probe.root / NOTE).parent.mkdir(parents=True)
    write_note(probe.root, [ModelError("The model's hash is wrong.", "Install it again.").as_record()])
    (probe.root / "active").write_text("activating\nactive\nactive\n")
    capsys.readouterr()
    assert probe.check() == 1
    assert "tsis.service is activating" in capsys.readouterr().out
    assert probe.run("--time-zone", "Europe/Berlin") == 1


def test_what_is_in_place_stays_as_it_is(probe, capsys):
    before = probe.asked()
    capsys.readouterr()
    assert probe.run("--time-zone", "Europe/Berlin") == 0
    assert {line.split()[0] for line in capsys.readouterr().out.splitlines()} == {"in", "next"}
    assert (
        probe.asked().removeprefix(before)
        == "systemctl is-active tsis.service tsis-update.path tsis-fallback.service\n"
    )


def test_check_tells_each_difference_and_changes_nothing(machine, capsys):
    before = {path: path.stat().st_mtime_ns for path in machine.root.rglob("*")}
    assert machine.check() == 1
    out = capsys.readouterr().out
    for words in (
        "names no serial number",
        "cage is not installed",
        "there is no user tsis",
        "no release is installed",
    ):
        assert words in out
    after = {path: path.stat().st_mtime_ns for path in machine.root.rglob("*")}
    asked = {machine.root, machine.root / "asked"}
    assert {path: time for path, time in after.items() if path not in asked} == {
        path: time for path, time in before.items() if path not in asked
    }


def test_the_boot_comes_before_the_release_which_needs_its_camera(machine, capsys):
    assert machine.run() == REBOOT
    assert "reboot, then run this again" in capsys.readouterr().out
    machine.install_a_release()
    assert machine.run() == 0


def test_lines_of_the_boot_hold_for_every_model_and_stand_once(probe):
    assert probe.text(CONFIG).startswith("[pi5]\ndtparam=ant2\n")
    ours = probe.text(CONFIG).split("[all]\n")[1]
    stated = ["dtparam=i2c_arm=on", "dtparam=strict_gpiod", "camera_auto_detect=0", "dtoverlay=ov9281"]
    assert ours.splitlines()[:4] == stated
    assert probe.text(KERNEL_LINE) == "console=tty1 rootwait cgroup_enable=memory panic=10\n"
    assert probe.run("--camera-overlay", "imx296") == REBOOT
    assert probe.text(CONFIG).count("[all]") == 1
    assert "dtoverlay=imx296" in probe.text(CONFIG)
    assert probe.check() == 0  # what was named stays
    assert "ov9281" not in probe.text(CONFIG)


def test_a_machine_without_a_boot_partition_has_none_to_be_set(machine):
    for file in (CONFIG, KERNEL_LINE, "etc/fstab"):
        (machine.root / file).unlink()
    machine.install_a_release()
    assert machine.run() == 0
    assert not (machine.root / CONFIG).exists()


def test_the_boot_partition_alone_becomes_read_only(probe):
    first, second = probe.text("etc/fstab").splitlines()
    assert first.split()[3] == "defaults,ro"
    assert second == "PARTUUID=0-02 / ext4 defaults,noatime 0 1"


def test_a_kernel_line_of_before_gets_what_is_new_in_it(probe, capsys):
    (probe.root / KERNEL_LINE).write_text("console=tty1 cgroup_enable=memory rootwait panic=0\n")
    capsys.readouterr()
    assert probe.check() == 1
    assert "cmdline.txt lacks panic=10\n" in capsys.readouterr().out
    assert probe.run() == REBOOT
    assert probe.text(KERNEL_LINE) == "console=tty1 cgroup_enable=memory rootwait panic=0 panic=10\n"


def test_a_computer_that_is_frozen_starts_again(probe):
    assert "\nRuntimeWatchdogSec=1min\n" in probe.text("etc/systemd/system.conf.d/tsis.conf")


def test_the_screens_browser_saves_no_file(probe):
    assert json.loads(probe.text("etc/chromium/policies/managed/tsis.json")) == {"DownloadRestrictions": 3}


def test_nothing_is_swapped_to_the_card(probe, capsys):
    assert "\nMechanism=zram\n" in probe.text("etc/rpi/swap.conf.d/tsis.conf")
    (probe.root / "var/swap").parent.mkdir(exist_ok=True)
    (probe.root / "var/swap").touch()
    capsys.readouterr()
    assert probe.check() == 1
    assert "/var/swap is on the card" in capsys.readouterr().out
    assert probe.run() == 0
    assert "systemctl disable --now dphys-swapfile.service" in probe.asked()
    assert not (probe.root / "var/swap").exists()
    assert probe.check() == 0


def test_a_release_that_the_machine_can_run_no_more_is_a_difference(probe, monkeypatch, capsys):
    """As after an upgrade to the next Debian in place: its Python is another one."""
    python = probe.root / "opt/tsis/current/bin/python"
    python.unlink()
    capsys.readouterr()
    assert probe.check() == 1
    assert "current/bin/python cannot be run: No such file or directory" in capsys.readouterr().out
    monkeypatch.setenv("PYTHONPATH", str(ROOT))  # provisioning runs from the wheel, which has what the release lacks
    python.symlink_to(Path(sys.executable).resolve())
    assert probe.check() == 1
    assert "current/bin/python does not run: ModuleNotFoundError: No module named 'device'" in capsys.readouterr().out


def test_the_deploy_account_can_do_one_thing(probe):
    words = 'restrict,command="/opt/tsis/updater/bin/python -m device.update receive"'
    assert probe.text("etc/tsis/deploy_keys") == f"{words} {KEY} who@where\n"


def test_another_key_may_send_releases_beside_the_first(probe):
    (probe.root / "key.pub").write_text(KEY.replace("aB", "zZ") + "\n")
    assert probe.run() == 0
    assert len(probe.text("etc/tsis/deploy_keys").splitlines()) == 2


def test_passwords_are_not_refused_as_long_as_nobody_has_a_key(machine, capsys):
    (machine.root / "home/pi/.ssh/authorized_keys").write_text("# none\n")
    assert machine.run() == 1
    assert "ssh-copy-id" in capsys.readouterr().err
    assert not (machine.root / "etc/ssh/sshd_config.d/00-tsis.conf").exists()


def test_a_probe_of_another_serial_number_is_refused_before_anything_is_changed(probe, capsys):
    before = probe.text("etc/tsis/config.toml")
    assert probe.run(serial="TSIS-0008") == 1
    assert "This probe is TSIS-0007, not TSIS-0008" in capsys.readouterr().err
    assert probe.text("etc/tsis/config.toml") == before


def test_settings_that_are_there_keep_what_they_say(machine):
    settings = machine.root / "etc/tsis/config.toml"
    settings.parent.mkdir()
    settings.write_text("[server]\nport = 9000\n")
    assert machine.run() == REBOOT
    assert read_table(settings) == {"serial": "TSIS-0007", "server": {"port": 9000}}


@pytest.mark.parametrize("serial", ["", "TSIS-0000", 'a"b', "a b", "ä", "x" * 64])
def test_what_is_no_serial_number_is_refused(machine, serial, capsys):
    assert machine.run(serial=serial) == 1
    assert "is no serial number" in capsys.readouterr().err


def test_keys_that_a_release_has_changed_stay(probe, capsys):
    """A committed release may have brought the next key: the first one no longer opens the door."""
    (probe.root / "etc/tsis/release_signers").write_text(SIGNER.replace("aB", "zZ"))
    assert probe.check() == 0
    assert probe.run() == 1
    assert "trusts other keys" in capsys.readouterr().err


def test_a_time_zone_that_the_machine_does_not_know_is_refused(machine, capsys):
    assert machine.run("--time-zone", "Mars/Olympus") == 1
    assert "Mars/Olympus" in capsys.readouterr().err


def test_a_release_for_another_python_is_refused_before_anything_is_changed(machine, tmp_path, capsys):
    """As on a newer Raspberry Pi OS: it had got packages, lost its passwords and been rebooted before it was told."""
    release = tmp_path / "of_another.release"
    release.write_bytes(release_file(new_key(tmp_path, "good"), "1.0", 10, python="3.99"))
    before = sorted(machine.root.rglob("*"))
    assert machine.run("--release", str(release)) == 1
    assert "for Python 3.99" in capsys.readouterr().err
    assert sorted(machine.root.rglob("*")) == before


def test_a_probe_asks_the_time_servers_that_are_named(probe, capsys):
    servers = "ntp1.hospital.example 192.0.2.7"
    assert probe.check("--time-servers", servers) == 1
    assert probe.run("--time-servers", servers) == 0
    assert probe.check("--time-servers", servers) == 0
    assert f"NTP={servers}\n" in (probe.root / "etc/systemd/timesyncd.conf.d/tsis.conf").read_text()
    assert probe.run("--time-servers", "ntp\nRootDistanceMaxSec=9d") == 1
    assert "are no time servers" in capsys.readouterr().err
    assert probe.check("--time-servers", servers) == 0


def test_a_stand_in_is_not_asked_for_the_packages_of_a_pi(machine, capsys):
    machine.check("--stand-in")
    assert "python3-picamera2" not in capsys.readouterr().out
    machine.check()
    assert "python3-picamera2" in capsys.readouterr().out


def test_each_unit_is_a_link_into_the_release_that_it_belongs_to(probe):
    links = unit_links().links
    folder = "/etc/systemd/system"
    assert links[f"{folder}/tsis.service"] == "/opt/tsis/current/systemd/tsis.service"
    assert links[f"{folder}/tsis-boot.service"] == "/opt/tsis/updater/systemd/tsis-boot.service"
    assert links[f"{folder}/multi-user.target.wants/tsis-update.path"] == "../tsis-update.path"
    for link, to in links.items():
        assert os.readlink(probe.root / link.lstrip("/")) == to


def test_a_command_that_fails_is_told_with_what_it_says(machine, monkeypatch, capsys):
    apt = Path(os.environ["PATH"].split(":")[0], "apt-get")
    apt.write_text("#!/bin/sh\necho E: no network >&2\nexit 100\n")
    assert machine.run() == 1
    assert "E: no network" in capsys.readouterr().err


def test_it_runs_from_a_zip_with_the_standard_library_alone(machine, tmp_path):
    """As it does on a fresh machine, from the wheel: -S leaves out all that was installed, -P where it is run."""
    wheel = tmp_path / "tsis.whl"
    with zipfile.ZipFile(wheel, "w") as file:
        for path in [ROOT / "device/__init__.py", *(ROOT / "device/files").glob("*.py")]:
            file.write(path, path.relative_to(ROOT))
        for path in (ROOT / "device/provisioning").glob("*.py"):
            file.write(path, path.relative_to(ROOT))
        for path in (ROOT / "systemd").iterdir():
            file.write(path, Path("device/shipped/systemd", path.name))
    command = [sys.executable, "-S", "-P", "-m", "device.provisioning", "--check", "--root", str(machine.root)]
    done = subprocess.run(command, env=os.environ | {"PYTHONPATH": str(wheel)}, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, "")
    assert "tsis-boot.service is no link" in done.stdout


def test_names_of_the_parts_are_there_before_the_first_release_asks_for_them(machine):
    assert machine.run() == REBOOT
    for name in ("tsis-force.rules", "tsis-parts.rules"):
        assert machine.text(f"etc/udev/rules.d/60-{name}") == (ROOT / "systemd" / name).read_text()
    assert "udevadm trigger --settle --subsystem-match=tty" in machine.asked()
