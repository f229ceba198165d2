"""The certificates, keys and secrets that settings name: which of them the daemon's user cannot read, and why.

No backup holds them, and whoever renews one writes it as root: the daemon reads it at its next start, months later.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.files.file_reader import DAEMON_USER, FileReader
from device.files.plain_settings import below

NAMED_FILES = (
    "server.certificate",
    "server.certificate_key",
    "server.client_authority",
    "dicom.tls_authority",
    "dicom.tls_certificate",
    "dicom.tls_key",
    "webhook.secret_file",
    "webhook.tls_authority",
)
HIDDEN = tuple(map(Path, ("/home", "/root", "/run/user", "/tmp", "/var/tmp")))
"""What the daemon's service has not, whoever may read it: ProtectHome and PrivateTmp of systemd/tsis.service."""


@dataclass(frozen=True)
class NamedFile:
    """A file that a setting names, and what keeps the daemon from it."""

    setting: str
    path: Path
    problem: str

    def __str__(self) -> str:
        return f"{self.setting} names {self.path}: {self.problem}."

    def as_record(self) -> dict[str, str]:
        """Return it as JSON object."""
        return {"setting": self.setting, "path": str(self.path), "problem": self.problem}


def named_files(values: Mapping[str, Any]) -> list[tuple[str, Path]]:
    """Return the settings, of these by their full names, that name a file of this kind, each with its file."""
    return [(name, Path(str(values[name]))) for name in NAMED_FILES if values.get(name)]


def unreadable_files(values: Mapping[str, Any], reader: FileReader, root: Path = Path("/")) -> list[NamedFile]:
    """Return the files that settings, by their full names, name and the reader cannot read; `root` stands for /."""
    found = ((name, path, _problem(path, below(root, path), reader)) for name, path in named_files(values))
    return [NamedFile(name, path, problem) for name, path, problem in found if problem]


def _problem(stated: Path, path: Path, reader: FileReader) -> str:
    is_daemon = reader.name == DAEMON_USER
    if is_daemon and any(stated.is_relative_to(folder) for folder in HIDDEN):
        return "the daemon's service does not see that folder; keep it in /etc/tsis"
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return "it is not there"
    except OSError as error:
        return f"the user {reader.name} cannot look for it ({error.strerror})"
    if path.is_dir():
        return "it is a folder"
    return "" if reader.can_read(path) else f"the user {reader.name} cannot read it"
