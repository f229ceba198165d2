"""Debian's packages that a probe needs beside its release."""

from __future__ import annotations

from dataclasses import dataclass

from device.provisioning.item import told
from device.provisioning.target import ProvisioningFailed, TargetMachine

NEEDED = (
    "cage",
    "chromium",
    "fonts-dejavu-core",
    "gpiod",
    "i2c-tools",
    "libpam-systemd",
    "openssh-server",
    "openssl",
    "xwayland",
)
"""The screen's compositor, browser, font, session and X server (without which Debian's cage does not start), the
tools of the bring-up, sshd with ssh-keygen, and what makes the server's certificate. A release holds its Python
packages, so pip and venv are not needed."""
ONLY_RASPBERRY_PI_OS = ("python3-picamera2",)
"""libcamera fits the kernel and firmware of Raspberry Pi OS, so it comes from there."""
WAIT_FOR_LOCK = "-oDPkg::Lock::Timeout=300"


@dataclass(frozen=True)
class PackagesItem:
    """Packages of apt."""

    title: str
    names: tuple[str, ...]
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return which are not installed."""
        return told([f"{name} is not installed" for name in self._missing(target)], most=len(self.names))

    def apply(self, target: TargetMachine) -> None:
        """Install those that are missing, with what they need and without what they only recommend."""
        target.run("apt-get", WAIT_FOR_LOCK, "update", "-qq")
        try:
            target.run("env", "DEBIAN_FRONTEND=noninteractive", "apt-get", WAIT_FOR_LOCK, "install", "-y", "-qq",
                       "--no-install-recommends", *self._missing(target))  # fmt: skip
        except ProvisioningFailed as error:
            said = "Is this Raspberry Pi OS (64 bit), Trixie or Bookworm, and does it reach its package servers?"
            raise ProvisioningFailed(str(error), said) from error

    def _missing(self, target: TargetMachine) -> list[str]:
        listed = target.asked("dpkg-query", "--show", "--showformat=${Package} ${db:Status-Status}\n", *self.names)
        installed = {line.split()[0] for line in listed.splitlines() if line.endswith(" installed")}
        return [name for name in self.names if name not in installed]
