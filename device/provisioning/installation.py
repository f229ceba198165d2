"""The probe's units as links into the release that runs, the first release, and that all of it goes.

The daemon and what belongs to it are those of `current`; boot check and installer are those of `updater`, the last
release that has proved itself. So a release changes its units by being switched to, and a bad one cannot take the way
back with it.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from device.files.start_note import read_note
from device.provisioning.item import LinkItem, TextItem, told
from device.provisioning.target import ProvisioningFailed, TargetMachine, systemd_files

CURRENT, UPDATER = "/opt/tsis/current", "/opt/tsis/updater"
UNITS = "/etc/systemd/system"
UNIT_KINDS = (".service", ".path", ".socket", ".timer")
OF_UPDATER = ("tsis-boot.", "tsis-update.", "tsis-fallback.")
AT_BOOT = "WantedBy=multi-user.target"
FOLDERS_OF = {".sysusers.conf": "/etc/sysusers.d/", ".tmpfiles.conf": "/etc/tmpfiles.d/"}
"""Where files go that are no units, by how their names end."""
RULES = "/etc/udev/rules.d/60-"
DAEMON = "tsis.service"
GOING = (DAEMON, "tsis-update.path", "tsis-fallback.service")
STARTED_AGAIN = ("activating", "deactivating")
"""What systemd calls a daemon that has failed and is started again, and darkens the LEDs before that."""
SYSTEM = (
    "Take the release for its system: SYSTEM=trixie for Raspberry Pi OS Lite (64-bit), with Python 3.13, and "
    "SYSTEM=bookworm for the one called Legacy, with 3.11."
)
RELOAD = ("systemctl", "daemon-reload")
SUBSYSTEMS = ("tty", "i2c-dev", "gpio", "video4linux")
UDEV = (
    ("udevadm", "control", "--reload"),
    ("udevadm", "trigger", "--settle", *(f"--subsystem-match={name}" for name in SUBSYSTEMS)),
)


def unit_links() -> LinkItem:
    """Return the links of all units, and of those that start at boot."""
    links = {}
    for name, text in systemd_files():
        if name.endswith(UNIT_KINDS):
            release = UPDATER if name.startswith(OF_UPDATER) else CURRENT
            links[f"{UNITS}/{name}"] = f"{release}/systemd/{name}"
            if AT_BOOT in text.splitlines():
                links[f"{UNITS}/multi-user.target.wants/{name}"] = f"../{name}"
    return LinkItem("systemd's units", links, (RELOAD,))


def other_links() -> LinkItem:
    """Return the links of users and folders."""
    links = {}
    for name, _ in systemd_files():
        for ending, folder in FOLDERS_OF.items():
            if name.endswith(ending):
                links[f"{folder}{name.removesuffix(ending)}.conf"] = f"{CURRENT}/systemd/{name}"
    return LinkItem("users and folders of the release", links)


@dataclass(frozen=True)
class UdevItem:
    """Names and groups of the probe's parts. They are copies: the first release needs them before it is installed."""

    title: str = "udev's rules"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return which rules are missing or other ones."""
        return told([words for rule in self._rules() if (words := rule.differs(target))])

    def apply(self, target: TargetMachine) -> None:
        """Write them and let udev look at every part anew; a machine without udev has no parts that are plugged in."""
        for rule in self._rules():
            rule.apply(target)
        for command in UDEV:
            target.asked(*command)

    def _rules(self) -> list[TextItem]:
        rules = [(name, text) for name, text in systemd_files() if name.endswith(".rules")]
        return [TextItem(self.title, f"{RULES}{name}", text) for name, text in rules]


@dataclass(frozen=True)
class FittingReleaseItem:
    """That the release which is to be installed can run here: looked at before anything of the machine is changed.

    Another Raspberry Pi OS has another Python. Whether the release is trusted is its installer's to say.
    """

    file: str
    title: str = "release for this machine"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return why it cannot run here; nothing without a file."""
        if not Path(self.file).is_file():
            return ""
        command = [sys.executable, "-m", "device.update", "--root", str(target.root), "fits", self.file]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return (done.stderr.strip() or "it cannot be looked at") if done.returncode else ""

    def apply(self, target: TargetMachine) -> None:
        """Raise `ProvisioningFailed`: nothing that is done to the machine makes it fit."""
        raise ProvisioningFailed(self.differs(target), SYSTEM)


@dataclass(frozen=True)
class FirstReleaseItem:
    """A release that is installed. Which one is none of ours later on: that is what `make deploy` is for."""

    file: str
    title: str = "release"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether none is installed, or one that does not run: another Raspberry Pi OS has another Python."""
        if not all(target.path(f"{link}/manifest.json").is_file() for link in (CURRENT, UPDATER)):
            return "no release is installed"
        return told([words for link in (CURRENT, UPDATER) if (words := _why_not(target.path(f"{link}/bin/python")))])

    def apply(self, target: TargetMachine) -> None:
        """Let the installer of this wheel install it, telling its progress as it goes."""
        if not self.file:
            raise ProvisioningFailed("No release file was given.", "Name it: --release.")
        command = [sys.executable, "-m", "device.update", "--root", str(target.root), "install", self.file]
        ended = subprocess.run(command, check=False)
        if ended.returncode:
            raise ProvisioningFailed(f"The release was not installed (exit code {ended.returncode}).", "See above.")


def _why_not(python: Path) -> str:
    """Return why a release does not run by its own Python and packages, nothing where it does.

    Isolated, for PYTHONPATH leads to this very wheel; and nothing is written beside what the release lists.
    """
    command = [str(python), "-I", "-B", "-c", "import device"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except OSError as error:
        return f"{python} cannot be run: {error.strerror}"
    return f"{python} does not run: {(done.stderr.splitlines() or [''])[-1]}" if done.returncode else ""


@dataclass(frozen=True)
class GoingItem:
    """The daemon, the updater's path and the page for when the daemon is gone, going."""

    title: str = "the probe goes"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return which of them does not; a daemon that says that a part is missing is started again and again."""
        states = target.asked("systemctl", "is-active", *GOING).split()
        note = read_note(target.root)
        waits = [DAEMON] if note and note.is_of_the_machine else []
        pairs = zip(GOING, [*states, *["unknown"] * len(GOING)], strict=False)
        return told([
            f"{unit} is {state}" for unit, state in pairs
            if state != "active" and not (unit in waits and state in STARTED_AGAIN)
        ])  # fmt: skip

    def apply(self, target: TargetMachine) -> None:
        """Start them, and the screen; a daemon that does not start says why, and is judged by that."""
        target.run_each((RELOAD, ("systemctl", "start", *GOING[1:])))
        target.asked("systemctl", "start", DAEMON)
        target.run("systemctl", "start", "--no-block", "tsis-kiosk.service")
