"""Who there is on a probe: users and groups of systemd/tsis.sysusers.conf, and who comes in by ssh.

The account tsis-deploy can do one thing, whatever the client asks for: hand over a release file and follow what becomes
of it. Nobody logs in by a password.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from device.provisioning.item import TextItem, told, write_readable
from device.provisioning.target import ProvisioningFailed, TargetMachine, systemd_file

SYSUSERS, TMPFILES = "tsis.sysusers.conf", "tsis.tmpfiles.conf"
DEPLOY_KEYS = "/etc/tsis/deploy_keys"
ONLY_RECEIVE = 'restrict,command="/opt/tsis/updater/bin/python -m device.update receive"'
SSH_SETTINGS = f"""# Made by provisioning. The first file that names a setting decides, and this is the first.
PasswordAuthentication no
KbdInteractiveAuthentication no
Match User tsis-deploy
    AuthorizedKeysFile {DEPLOY_KEYS}
"""
SSH_FILE = "/etc/ssh/sshd_config.d/00-tsis.conf"
KEY_KINDS = ("ssh-ed25519", "ecdsa-sha2-", "sk-", "ssh-rsa")


@dataclass(frozen=True)
class AccountsItem:
    """Users, groups and who belongs to which."""

    title: str = "users and groups"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return which are missing."""
        return told(list(_missing(target)))

    def apply(self, target: TargetMachine) -> None:
        """Let systemd-sysusers make what is missing."""
        target.run("systemd-sysusers", f"--root={target.root}", "-", stdin=systemd_file(SYSUSERS))


@dataclass(frozen=True)
class FoldersItem:
    """The folders of systemd/tsis.tmpfiles.conf."""

    title: str = "folders"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return which are missing or have another mode."""
        return told(list(_other_folders(target)))

    def apply(self, target: TargetMachine) -> None:
        """Let systemd-tmpfiles make them."""
        target.run("systemd-tmpfiles", f"--root={target.root}", "--create", "-", stdin=systemd_file(TMPFILES))


@dataclass(frozen=True)
class DeployKeyItem:
    """The public key whose owner may send a release; other keys that are there stay."""

    key: str
    title: str = "the key of who may send a release"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether this key may not yet, or without a key to look for whether none may."""
        lines = target.text(DEPLOY_KEYS).splitlines()
        if not self.key:
            return "" if lines else f"{DEPLOY_KEYS} holds no key"
        return "" if self._line() in lines else f"{DEPLOY_KEYS} does not hold this key"

    def apply(self, target: TargetMachine) -> None:
        """Add the key; raise `ProvisioningFailed` when there is none, or it is none."""
        write_readable(target, DEPLOY_KEYS, target.text(DEPLOY_KEYS) + self._line() + "\n")

    def _line(self) -> str:
        words = self.key.split()
        if len(words) < 2 or "\n" in self.key.strip() or not words[0].startswith(KEY_KINDS):
            raise ProvisioningFailed(
                "No public key of who may send releases was given.", "Name its file: --deploy-key."
            )
        return f"{ONLY_RECEIVE} {' '.join(words)}"


@dataclass(frozen=True)
class SshItem:
    """sshd without passwords, and the account that only sends releases."""

    title: str = "ssh by key alone"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether sshd's settings are others."""
        return self._file().differs(target)

    def apply(self, target: TargetMachine) -> None:
        """Set sshd; raise `ProvisioningFailed` when nobody but by password could log in afterwards."""
        homes = [target.path("/root"), *target.path("/home").glob("*")]
        if not any(_has_key(str(home / ".ssh/authorized_keys")) for home in homes):
            cause = "No user of this machine has an ssh key, and passwords are about to be refused."
            raise ProvisioningFailed(cause, "Put yours there first: ssh-copy-id USER@HOST.")
        self._file().apply(target)

    def _file(self) -> TextItem:
        known = (("sshd", "-t"), ("systemctl", "reload", "ssh.service"))
        return TextItem(self.title, SSH_FILE, SSH_SETTINGS, known)


def _has_key(file: str) -> bool:
    try:
        with open(file, encoding="utf-8") as lines:
            return any(line.strip() and not line.startswith("#") for line in lines)
    except OSError:
        return False


def _missing(target: TargetMachine) -> Iterator[str]:
    users, groups = (_by_name(target.text(file)) for file in ("/etc/passwd", "/etc/group"))
    for kind, name, *rest in _lines(SYSUSERS):
        if kind == "u" and name not in users:
            yield f"there is no user {name}"
        elif kind == "g" and name not in groups:
            yield f"there is no group {name}"
        elif kind == "m" and name not in groups.get(rest[0], [""])[-1].split(","):
            yield f"{name} is not in the group {rest[0]}"


def _other_folders(target: TargetMachine) -> Iterator[str]:
    for folder, mode in (line[1:3] for line in _lines(TMPFILES) if line[0] == "d"):
        path = target.path(folder)
        if not path.is_dir():
            yield f"{folder} is not there"
        elif path.stat().st_mode & 0o7777 != int(mode, 8):
            yield f"{folder} has the mode {path.stat().st_mode & 0o7777:04o}, not {mode}"


def _lines(name: str) -> list[list[str]]:
    return [line.split() for line in systemd_file(name).splitlines() if line and not line.startswith("#")]


def _by_name(table: str) -> dict[str, list[str]]:
    return {line.split(":")[0]: line.split(":") for line in table.splitlines()}
