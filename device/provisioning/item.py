"""What an item of the list is, and the kinds that several of them are: a file of a text, a link."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from device.files.durable import sync_directory, write_durably
from device.provisioning.target import ProvisioningFailed, TargetMachine


class ProvisioningItem(Protocol):
    """One thing that a probe has. It is there when `differs` says nothing; `apply` puts it right."""

    @property
    def title(self) -> str:
        """Return what it is, in a few words."""

    @property
    def wants_reboot(self) -> bool:
        """Return whether it only holds from the next boot on."""

    def differs(self, target: TargetMachine) -> str:
        """Return in words what differs, empty when nothing does; change nothing."""

    def apply(self, target: TargetMachine) -> None:
        """Put right what differs. Raises `ProvisioningFailed`."""


@dataclass(frozen=True)
class TextItem:
    """A file that holds exactly this text; `then` are commands that make it known."""

    title: str
    file: str
    content: str
    then: Sequence[Sequence[str]] = ()
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return whether the file is missing or has another text."""
        path = target.path(self.file)
        if not path.exists():
            return f"{self.file} is not there"
        return "" if target.text(self.file) == self.content else f"{self.file} has another text"

    def apply(self, target: TargetMachine) -> None:
        """Write the file and make it known."""
        write_readable(target, self.file, self.content)
        target.run_each(self.then)


@dataclass(frozen=True)
class LinkItem:
    """Links by their path, each with what it points to: it may point to what is not there yet."""

    title: str
    links: dict[str, str]
    then: Sequence[Sequence[str]] = ()
    wants_reboot: bool = False

    def differs(self, target: TargetMachine) -> str:
        """Return which links are missing or point elsewhere."""
        return told([f"{link} is no link to {to}" for link, to in self.links.items() if not _points(target, link, to)])

    def apply(self, target: TargetMachine) -> None:
        """Make or replace those, each from one moment to the next, and make it known."""
        for link, to in self.links.items():
            if not _points(target, link, to):
                _point(target, link, to)
        target.run_each(self.then)


def told(differences: list[str], most: int = 3) -> str:
    """Return the first differences as one sentence, and how many more there are."""
    more = len(differences) - most
    return ", ".join(differences[:most]) + (f" and {more} more" if more > 0 else "")


def write_readable(target: TargetMachine, file: str, content: str) -> None:
    """Write a file of root's that everybody may read, whole or not at all."""
    path = target.path(file)
    write_durably(path, content.encode())
    path.chmod(0o644)


def _points(target: TargetMachine, link: str, to: str) -> bool:
    path = target.path(link)
    return path.is_symlink() and os.readlink(path) == to


def _point(target: TargetMachine, link: str, to: str) -> None:
    path = target.path(link)
    if path.is_dir() and not path.is_symlink():
        raise ProvisioningFailed(f"{link} is a folder.", "Remove it, if nothing in it is needed.")
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.new")
    temporary.unlink(missing_ok=True)
    temporary.symlink_to(to)
    temporary.replace(path)
    sync_directory(path.parent)
