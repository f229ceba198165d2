"""What a release is built from: the files of a git checkout, the name of its commit, and its number.

Files are copied before they are packed, with one mode for all: what git ignores and the umask of a clone cannot get in.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from device.files.shipped import FOLDERS
from device.measurement.quantities import InvalidQuantity

LOCK = "requirements/device.lock"
PACKED = ("device", "host_tools", *FOLDERS.values(), LOCK, "pyproject.toml", "setup.py", "README.md", "LICENSE")
"""Files and folders that a release is made of; what else is in the repository does not change a byte of it."""


@dataclass(frozen=True)
class Checkout:
    """A repository at a commit: its root, the commit's hash and time (s since 1970), and what was changed since."""

    root: Path
    commit: str
    time_s: int
    changed: tuple[str, ...]

    @classmethod
    def at(cls, root: Path) -> Checkout:
        """Return the checkout in a folder; raise `InvalidQuantity` where git knows none."""
        commit, time_s = _git(root, "log", "-1", "--format=%H %ct").split()
        changed = _git(root, "status", "--porcelain", "--untracked-files=all", "--", *PACKED)
        return cls(root, commit, int(time_s), tuple(line[3:] for line in changed.splitlines()))

    def counter(self) -> int:
        """Return how many commits led here: it grows with every release of one line of work."""
        if _git(self.root, "rev-parse", "--is-shallow-repository").strip() == "true":
            bound, action = "a whole one", "say `git fetch --unshallow`, or give --counter"
            raise InvalidQuantity("clone", "shallow: its commits cannot be counted", bound, action)
        return int(_git(self.root, "rev-list", "--count", "HEAD"))

    def copy(self, into: Path) -> None:
        """Copy the files of `PACKED` that git does not ignore into a new folder."""
        listed = _git(self.root, "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--", *PACKED)
        for name in sorted(set(listed.split("\0")) - {""}):
            source, target = self.root / name, into / name
            if source.is_symlink() or not source.is_file():
                continue  # removed since the commit, or a link that is none of ours
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
            target.chmod(0o644)


def _git(root: Path, *words: str) -> str:
    """Return what git says; raise `InvalidQuantity` with its own words when it refuses."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    asked = ["git", "-C", str(root), "-c", "core.quotepath=off", *words]
    done = subprocess.run(asked, capture_output=True, text=True, env=environment, check=False)
    if done.returncode:
        raise InvalidQuantity("checkout", root, "a git repository", f"git says: {done.stderr.strip()}")
    return done.stdout
