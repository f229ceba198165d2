"""What holds from the next boot on: Raspberry Pi's config.txt and cmdline.txt, the partition they lie on, and swap.

Where a machine has no such file, as a container, there is nothing to be set. The boot partition is FAT, which has no
journal: a power cut while it is written may leave a card that does not boot. So it is mounted read-only, but for apt.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from device.files.durable import write_durably
from device.provisioning.item import TextItem
from device.provisioning.target import TargetMachine

FOLDER = "/boot/firmware"
CONFIG, KERNEL_LINE = f"{FOLDER}/config.txt", f"{FOLDER}/cmdline.txt"
BEGIN, END = "# begin of the probe's own lines", "# end of the probe's own lines"
MEMORY, PANIC = "cgroup_enable=memory", "panic=10"
"""Raspberry Pi's kernel counts memory by unit only with the first, and without it no MemoryMax= holds.

With the second it starts again 10 s after it has failed, as where the card did not answer: else it stands still.
"""
FSTAB = "/etc/fstab"
SWAP_FILE = "/var/swap"
SWAP_IN_MEMORY = """# Made by provisioning. What is swapped stays in memory, compressed.
[Main]
Mechanism=zram
"""
APT_HOOK = f"""// Made by provisioning: the boot partition is read-only, but while packages are installed.
DPkg::Pre-Invoke {{"mountpoint -q {FOLDER} && mount -o remount,rw {FOLDER} || true";}};
DPkg::Post-Invoke {{"mountpoint -q {FOLDER} && mount -o remount,ro {FOLDER} || true";}};
"""


@dataclass(frozen=True)
class BootSettingsItem:
    """I2C and the LEDs' enable line on the header, and the sensor by its name.

    What detection finds is only Raspberry Pi's own cameras.
    """

    camera_overlay: str = ""
    """As it is unless named, and an OV9281's where none was."""
    title: str = "I2C and camera at boot"
    wants_reboot: bool = True

    def differs(self, target: TargetMachine) -> str:
        """Return whether config.txt lacks our lines; nothing where there is no such file."""
        return _differs(target, CONFIG, self._with_ours, "does not set I2C and camera")

    def apply(self, target: TargetMachine) -> None:
        """Put our lines at its end, where they hold for every model and override what is above."""
        _rewrite(target, CONFIG, self._with_ours)

    def _with_ours(self, text: str) -> str:
        before, _, rest = text.partition(f"{BEGIN}\n")
        ours, _, after = rest.partition(f"{END}\n")
        found = re.search(r"^dtoverlay=(\S+)$", ours, re.MULTILINE)
        overlay = self.camera_overlay or (found[1] if found else "ov9281")
        camera = ["camera_auto_detect=0", f"dtoverlay={overlay}"]
        # Else the kernel leaves the LEDs' enable line as it was when the process that held it was killed.
        lines = ["[all]", "dtparam=i2c_arm=on", "dtparam=strict_gpiod", *camera]
        kept = before.rstrip("\n") + "\n" + after
        return "\n".join([kept.rstrip("\n"), "", BEGIN, *lines, END, ""]).lstrip("\n")


@dataclass(frozen=True)
class KernelLineItem:
    """The words of the kernel's command line by which limits of memory hold, and a failed kernel starts again."""

    title: str = "kernel's command line"
    wants_reboot: bool = True

    def differs(self, target: TargetMachine) -> str:
        """Return whether cmdline.txt lacks a word; nothing where there is no such file."""
        lacks = " and ".join(_lacking(target.text(KERNEL_LINE)))
        return _differs(target, KERNEL_LINE, _with_words, f"lacks {lacks}")

    def apply(self, target: TargetMachine) -> None:
        """Add them at the end of the one line, where they override what stands before."""
        _rewrite(target, KERNEL_LINE, _with_words)


@dataclass(frozen=True)
class ReadOnlyBootItem:
    """The boot partition, mounted read-only from the next boot on."""

    title: str = "boot partition read-only"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether fstab mounts it for writing, or apt would be in the way."""
        return _differs(target, FSTAB, _read_only, f"mounts {FOLDER} for writing") or _apt_hook().differs(target)

    def apply(self, target: TargetMachine) -> None:
        """Change its line in fstab, and let apt write all the same."""
        if target.text(FSTAB):
            write_durably(target.path(FSTAB), _read_only(target.text(FSTAB)).encode())
            target.path(FSTAB).chmod(0o644)
        _apt_hook().apply(target)


@dataclass(frozen=True)
class SwapItem:
    """No swap on the card: what is written there has patients' names, which no erasure finds, and wears it out.

    Raspberry Pi OS of Debian 13 writes what its rpi-swap compresses to a file (swap.conf(5)), that of Debian 12 swaps
    to one by dphys-swapfile.
    """

    title: str = "no swap on the card"
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether there is a swap file, or will be one."""
        is_there = target.path(SWAP_FILE).exists()
        return f"{SWAP_FILE} is on the card" if is_there else _swap_settings().differs(target)

    def apply(self, target: TargetMachine) -> None:
        """Settle what is made at the next boot, and take away what is there; it may be in use until then."""
        _swap_settings().apply(target)
        target.asked("systemctl", "disable", "--now", "dphys-swapfile.service")
        target.asked("swapoff", SWAP_FILE)
        target.path(SWAP_FILE).unlink(missing_ok=True)


def _swap_settings() -> TextItem:
    return TextItem("swap", "/etc/rpi/swap.conf.d/tsis.conf", SWAP_IN_MEMORY)


def _apt_hook() -> TextItem:
    return TextItem("apt", "/etc/apt/apt.conf.d/90-tsis-boot", APT_HOOK)


def _lacking(line: str) -> list[str]:
    return [word for word in (MEMORY, PANIC) if word not in line.split()]


def _with_words(line: str) -> str:
    lacking = _lacking(line)
    return " ".join([line.strip(), *lacking]) + "\n" if lacking else line


def _read_only(table: str) -> str:
    return "".join(_read_only_line(line) for line in table.splitlines(keepends=True))


def _read_only_line(line: str) -> str:
    words = line.split()
    if len(words) < 4 or words[0].startswith("#") or words[1] != FOLDER or "ro" in words[3].split(","):
        return line
    options = [option for option in words[3].split(",") if option != "rw"] + ["ro"]
    return "\t".join([*words[:3], ",".join(options), *words[4:]]) + "\n"


def _differs(target: TargetMachine, file: str, changed: Callable[[str], str], words: str) -> str:
    text = target.text(file)
    return f"{file} {words}" if text and changed(text) != text else ""


def _rewrite(target: TargetMachine, file: str, changed: Callable[[str], str]) -> None:
    with _writable(target):
        write_durably(target.path(file), changed(target.text(file)).encode())


@contextmanager
def _writable(target: TargetMachine) -> Iterator[None]:
    """Let the boot partition be written meanwhile, also when we have made it read-only before."""
    is_read_only = bool(os.statvfs(target.path(FOLDER)).f_flag & os.ST_RDONLY)
    if is_read_only:
        target.run("mount", "-o", "remount,rw", FOLDER)
    try:
        yield
    finally:
        if is_read_only:
            target.run("mount", "-o", "remount,ro", FOLDER)
