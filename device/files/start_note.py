"""Why the daemon did not start, written by itself in memory (/run): schema `tsis.start/1`.

Read by the fallback, whose page says it, and by the installer of a first release. Standard library only.
The folder is the unit's RuntimeDirectory; where it is missing, as on a laptop, nothing is written.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

SCHEMA = "tsis.start/1"
NOTE, RELEASE_LINK = "run/tsis/start.json", "opt/tsis/current"
FIELDS = ("code", "title", "severity", "cause", "remedy")
OF_THE_MACHINE = ("E001", "E1", "E2", "E3")
"""How codes of settings, camera, light and load cell begin: what a release finds, and does not bring."""


@dataclass(frozen=True)
class StartNote:
    """The faults of a start that failed, as records of `FIELDS`; the process and the release that failed."""

    pid: int
    release: str
    faults: tuple[dict[str, str], ...]

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of its faults."""
        return tuple(fault["code"] for fault in self.faults)

    @property
    def is_of_the_machine(self) -> bool:
        """Whether all that is missing is the machine's: settings, or a part that is not there or not wired."""
        return all(code.startswith(OF_THE_MACHINE) for code in self.codes)

    def __str__(self) -> str:
        return " ".join(f"{fault['code']} {fault['cause']}" for fault in self.faults)


def write_note(root: Path, faults: Sequence[Mapping[str, str]]) -> None:
    """Note why this process does not start, by records of faults; that it cannot be written changes nothing."""
    path = root / NOTE
    record = {
        "schema": SCHEMA,
        "pid": os.getpid(),
        "release": linked_release(root),
        "faults": list(map(dict, faults)),
    }
    temporary = path.with_name(f"{path.name}.tmp")
    with suppress(OSError):
        temporary.write_text(json.dumps(record), encoding="utf-8")
        temporary.replace(path)


def linked_release(root: Path) -> str:
    """Return the name of the release that the daemon is to run; empty when it is none."""
    try:
        return Path(os.readlink(root / RELEASE_LINK)).name
    except OSError:
        return ""


def clear_note(root: Path) -> None:
    """Forget why an earlier start failed: this one did not."""
    with suppress(OSError):
        (root / NOTE).unlink(missing_ok=True)


def read_note(root: Path) -> StartNote | None:
    """Return why the last start that said so failed; None when there is nothing that can be read."""
    try:
        record = json.loads((root / NOTE).read_bytes())
        if record["schema"] != SCHEMA:
            return None
        faults = tuple(_fault(fault) for fault in record["faults"])
        return StartNote(int(record["pid"]), str(record["release"]), faults) if faults else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _fault(record: dict[str, Any]) -> dict[str, str]:
    return {field: str(record[field]) for field in FIELDS}
