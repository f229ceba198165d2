"""Where an update finds and leaves everything: all paths of a probe, below one root.

A release lies in a folder of its own, and links say which one runs. What outlives a release, as settings, keys and
measurements, lies in none of them.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from device.files.durable import sync_directory

STAGED, REMOVED = ".incoming-", ".removed-"
"""How the name of a folder begins that is not a release yet, or no longer: only whole releases have a plain name."""


@dataclass(frozen=True)
class UpdateLayout:
    """The paths of a probe; `root` stands for / (a test's is a folder of its own)."""

    root: Path = Path("/")

    @property
    def programs(self) -> Path:
        """Return the folder of the releases and of the links to them."""
        return self.root / "opt/tsis"

    @property
    def releases(self) -> Path:
        """Return the folder with a folder for each release."""
        return self.programs / "releases"

    @property
    def current(self) -> Path:
        """Return the link to the release that the daemon runs."""
        return self.programs / "current"

    @property
    def way_back(self) -> Path:
        """Return the link that takes the place of `current` when a trial fails, made before: a disk may be full."""
        return self.programs / ".current.back"

    @property
    def updater(self) -> Path:
        """Return the link to the release that was committed last; its code checks the boot."""
        return self.programs / "updater"

    @property
    def notes(self) -> Path:
        """Return the folder of state and progress, which only root writes."""
        return self.root / "var/lib/tsis-update"

    @property
    def state(self) -> Path:
        """Return the file of what was decided."""
        return self.notes / "state.json"

    @property
    def progress(self) -> Path:
        """Return the file that says how far the update under way is, or how the last one ended."""
        return self.notes / "progress.json"

    @property
    def lock(self) -> Path:
        """Return the file that is locked by the one update at a time."""
        return self.notes / "lock"

    @property
    def taken(self) -> Path:
        """Return where an uploaded release file lies while it is installed, out of its sender's reach."""
        return self.notes / "taken.release"

    @property
    def incoming(self) -> Path:
        """Return the folder in which the group tsis-update leaves what is to be done."""
        return self.notes / "incoming"

    @property
    def uploaded(self) -> Path:
        """Return the release file that waits to be installed."""
        return self.incoming / "update.release"

    @property
    def roll_back_request(self) -> Path:
        """Return the file whose appearance asks for the previous release."""
        return self.incoming / "roll_back"

    @property
    def signers(self) -> Path:
        """Return the public keys that a release may be signed with (ssh-keygen's ALLOWED SIGNERS)."""
        return self.root / "etc/tsis/release_signers"

    @property
    def hardware(self) -> Path:
        """Return the file that names this probe's hardware in one line; without it, it is the first kind there was."""
        return self.root / "etc/tsis/hardware"

    def release(self, name: str) -> Path:
        """Return the folder of a release."""
        return self.releases / name

    def linked(self, link: Path) -> str | None:
        """Return the name of the release to which `current` or `updater` points, or None."""
        try:
            return Path(os.readlink(link)).name
        except OSError:
            return None

    def is_installed(self, name: str) -> bool:
        """Return whether a release lies there; under its plain name it is whole."""
        return bool(name) and (self.release(name) / "manifest.json").is_file()

    def inside(self, path: Path) -> Path:
        """Return where an absolute path of the probe lies below the root."""
        return self.root / path.relative_to(path.anchor)


def point(link: Path, target: Path) -> None:
    """Let a link point to a release, from one moment to the next and durably; it is relative, as its root may move."""
    temporary = link.with_name(f".{link.name}.new")
    make_link(temporary, target)
    temporary.replace(link)
    sync_directory(link.parent)


def make_link(link: Path, target: Path) -> None:
    """Make a link to a release, in place of one that may be there. Raises `OSError`."""
    link.unlink(missing_ok=True)
    link.symlink_to(target.relative_to(link.parent))
