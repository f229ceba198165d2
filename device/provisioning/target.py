"""The machine that becomes a probe: its files below one root, the commands that are run on it, what systemd/ holds."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

LAST_LINES = 12


class ProvisioningFailed(Exception):  # noqa: N818 - reads as what happened
    """An item cannot be put right, or must not be: the cause, and what to do."""

    def __init__(self, cause: str, remedy: str) -> None:
        super().__init__(f"{cause} {remedy}".strip())


@dataclass(frozen=True)
class TargetMachine:
    """A machine; `root` stands for / (a test's is a folder of its own), and commands are looked up in PATH."""

    root: Path = Path("/")

    def path(self, absolute: str) -> Path:
        """Return where an absolute path lies below the root."""
        return self.root / absolute.lstrip("/")

    def text(self, absolute: str) -> str:
        """Return the text of a file, empty when there is none."""
        try:
            return self.path(absolute).read_text(encoding="utf-8")
        except FileNotFoundError:
            return ""

    def run(self, *command: str, stdin: str = "") -> str:
        """Run a command to its end and return what it prints; raise `ProvisioningFailed` with its last lines."""
        try:
            done = subprocess.run(
                command,
                input=stdin,
                capture_output=True,
                text=True,
                env=os.environ | {"LC_ALL": "C.UTF-8"},
                check=False,
            )
        except OSError as error:
            raise ProvisioningFailed(f"{command[0]} cannot be run: {error.strerror}.", "") from error
        if done.returncode:
            said = "\n".join((done.stdout + done.stderr).splitlines()[-LAST_LINES:])
            raise ProvisioningFailed(f"{' '.join(command)} ended with {done.returncode}: {said}", "")
        return done.stdout

    def asked(self, *command: str) -> str:
        """Return what a command prints, whatever its exit code; nothing when it is not there."""
        try:
            return subprocess.run(command, capture_output=True, text=True, check=False).stdout
        except OSError:
            return ""

    def run_each(self, commands: Sequence[Sequence[str]]) -> None:
        """Run commands one after the other."""
        for command in commands:
            self.run(*command)


def systemd_files() -> Iterator[tuple[str, str]]:
    """Yield name and text of each file that goes into systemd/ of a release, from the wheel or the source tree."""
    folder = _systemd_folder()
    for file in sorted(folder.iterdir(), key=lambda one: one.name):
        if file.is_file():
            yield file.name, file.read_text(encoding="utf-8")


def systemd_file(name: str) -> str:
    """Return the text of one of them."""
    return dict(systemd_files())[name]


def _systemd_folder() -> Traversable:
    in_wheel = resources.files("device").joinpath("shipped").joinpath("systemd")
    return in_wheel if in_wheel.is_dir() else Path(__file__).resolve().parents[2] / "systemd"
