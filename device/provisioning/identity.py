"""What is a probe's own: its serial number, whose releases it takes, its time zone and who tells it the time."""

from __future__ import annotations

import os
import re
import tomllib
from dataclasses import dataclass
from itertools import pairwise

from device.provisioning.item import LinkItem, write_readable
from device.provisioning.target import ProvisioningFailed, TargetMachine

SETTINGS = "/etc/tsis/config.toml"
SIGNERS = "/etc/tsis/release_signers"
ZONES, ZONE_LINK = "/usr/share/zoneinfo", "/etc/localtime"
TIME_SERVERS = "/etc/systemd/timesyncd.conf.d/tsis.conf"
SERVER_NAMES = re.compile(r"[A-Za-z0-9][A-Za-z0-9.:-]*( [A-Za-z0-9][A-Za-z0-9.:-]*)*")
SERIAL = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,62}")
UNNAMED = "TSIS-0000"
"""The default of the setting `serial`: a probe that nobody has named."""
CERTIFICATES = "/var/lib/tsis/calibrations"


@dataclass(frozen=True)
class SerialItem:
    """The setting `serial`. A probe that has another one is refused: its certificate and recordings bear that one."""

    serial: str
    title: str = "serial number"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether the probe has no serial number, or another one."""
        found = _serial_of(target)
        if not found:
            return f"{SETTINGS} names no serial number"
        return "" if self.serial in ("", found) else f"this probe is {found}, not {self.serial}"

    def apply(self, target: TargetMachine) -> None:
        """Write the serial number, once and for all."""
        found = _serial_of(target)
        if found:
            cause = f"This probe is {found}, not {self.serial}: its certificates and recordings bear that name."
            raise ProvisioningFailed(cause, f"Is it the right HOST? Else change `serial` in {SETTINGS} by hand.")
        if not SERIAL.fullmatch(self.serial) or self.serial == UNNAMED:
            cause = f"{self.serial!r} is no serial number: 1 to 63 of A-Z a-z 0-9 . _ -, and not {UNNAMED}."
            raise ProvisioningFailed(cause, "Name the probe: --serial.")
        write_readable(target, SETTINGS, f'serial = "{self.serial}"\n' + target.text(SETTINGS))


def _serial_of(target: TargetMachine) -> str:
    try:
        return str(tomllib.loads(target.text(SETTINGS)).get("serial", ""))
    except tomllib.TOMLDecodeError as error:
        raise ProvisioningFailed(f"{SETTINGS} is not TOML: {error}.", "Correct it, or move it away.") from error


@dataclass(frozen=True)
class SignersItem:
    """The keys whose releases this probe takes. A committed release may have replaced them: then they stay."""

    signers: str
    title: str = "whose releases are taken"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether the probe trusts nobody yet, or none of those that were given."""
        found = _keys(target.text(SIGNERS))
        if not found:
            return f"{SIGNERS} names no key"
        given = _keys(self.signers)
        return "" if not given or found & given else f"{SIGNERS} names none of the keys that were given"

    def apply(self, target: TargetMachine) -> None:
        """Write the keys, once; raise `ProvisioningFailed` when the probe trusts others."""
        if _keys(target.text(SIGNERS)):
            cause = f"This probe trusts other keys than those that were given ({SIGNERS})."
            raise ProvisioningFailed(
                cause, "Give the file of those that sign its releases, or remove that one by hand."
            )
        if not _keys(self.signers):
            raise ProvisioningFailed("No key that signs releases was given.", "Name the file: --signers.")
        write_readable(target, SIGNERS, self.signers)


def _keys(signers: str) -> set[str]:
    """Return the keys of an allowed-signers file: the word after the kind of key."""
    words = [line.split() for line in signers.splitlines() if line.strip() and not line.startswith("#")]
    return {after for line in words for kind, after in pairwise(line) if "-" in kind and len(after) > 60}


@dataclass(frozen=True)
class TimeZoneItem:
    """The zone of the clock that the screen shows; the records are in UTC."""

    zone: str
    title: str = "time zone"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether the zone is another; nothing when none was asked for."""
        if not self.zone:
            return ""
        link = target.path(ZONE_LINK)
        found = os.readlink(link).partition("zoneinfo/")[2] if link.is_symlink() else "none"
        return "" if found == self.zone else f"the time zone is {found}, not {self.zone}"

    def apply(self, target: TargetMachine) -> None:
        """Set it; raise `ProvisioningFailed` for one that the machine does not know."""
        if not target.path(f"{ZONES}/{self.zone}").is_file():
            raise ProvisioningFailed(f"This machine knows no time zone {self.zone!r}.", "Name one as Europe/Berlin.")
        LinkItem(self.title, {ZONE_LINK: f"{ZONES}/{self.zone}"}).apply(target)
        write_readable(target, "/etc/timezone", f"{self.zone}\n")


@dataclass(frozen=True)
class TimeServersItem:
    """Who tells the probe the time: names or addresses, apart by a space. Source: timesyncd.conf(5).

    A hospital's network mostly lets nothing through to those of the distribution, and NetworkManager does not hand on
    to systemd-timesyncd what DHCP names.
    """

    servers: str
    title: str = "time servers"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether other ones are asked; nothing when none were given."""
        if not self.servers or target.text(TIME_SERVERS) == self._text:
            return ""
        return f"{TIME_SERVERS} does not name {self.servers}"

    def apply(self, target: TargetMachine) -> None:
        """Name them and ask them at once."""
        write_readable(target, TIME_SERVERS, self._text)
        target.run("systemctl", "restart", "systemd-timesyncd.service")

    @property
    def _text(self) -> str:
        return f"# Made by provisioning.\n[Time]\nNTP={self.servers}\n"


def require_server_names(servers: str) -> None:
    """Raise `ProvisioningFailed` unless these are names or addresses, or none at all."""
    if servers and not SERVER_NAMES.fullmatch(servers):
        cause = f"{servers!r} are no time servers: names or addresses, apart by one space."
        raise ProvisioningFailed(cause, "Name them as ntp1.hospital.example.")


def is_calibrated(target: TargetMachine) -> bool:
    """Return whether a certificate was ever activated: until then the probe is in commissioning, and shows E402."""
    return target.path(f"{CERTIFICATES}/active").exists()
