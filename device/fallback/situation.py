"""What is known while the daemon does not run: its unit, why it failed, which release there is, what an update does.

Each source may be missing or damaged: then less is said. systemd and its journal are asked by their own commands.
"""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.errors import DeviceError
from device.files.start_note import StartNote, linked_release, read_note

UNIT = "tsis.service"
NOTES = "var/lib/tsis-update"
COMMAND_S = 3.0
LOG_LINES = 20
UPDATING = {
    "verifying": "It is looked at.",
    "unpacking": "It is unpacked.",
    "switching": "It is started.",
    "checking": "It has to prove itself: up to two minutes.",
}
"""The states of progress.json in which an update is under way, in the operator's words."""


@dataclass(frozen=True)
class UnitState:
    """What systemd says of the daemon."""

    active: str
    result: str
    status: str
    pid: int

    @property
    def is_starting(self) -> bool:
        """Whether its process runs and has not said yet that it is ready."""
        return self.active == "activating" and self.pid != 0 and self.result == "success"


@dataclass(frozen=True)
class Situation:
    """What the page and the API say; `faults` are records of code, title, severity, cause and remedy."""

    headline: str
    hint: str
    faults: tuple[dict[str, str], ...] = ()
    log: tuple[str, ...] = ()
    release: str = ""
    last_good: str = ""
    is_updating: bool = False

    @property
    def may_roll_back(self) -> bool:
        """Whether there is another release to go back to, and no update that may go back by itself."""
        return bool(self.last_good) and self.last_good != self.release and not self.is_updating


def read_situation(root: Path = Path("/")) -> Situation:
    """Return what is known now; `root` stands for /."""
    release, last_good = _releases(root)
    note = read_note(root)
    if note and release and note.release != release:
        note = None  # of a release that does not run any more
    updating = UPDATING.get(str(_record(root / NOTES / "progress.json").get("state")), "")
    told = _told(updating, _unit(), note, release)
    return Situation(**told, release=release, last_good=last_good, is_updating=bool(updating))


def _told(updating: str, unit: UnitState | None, note: StartNote | None, release: str) -> dict[str, Any]:
    if updating:
        return {"headline": "A release is being installed", "hint": updating}
    if unit and unit.active == "inactive":
        return {"headline": "The probe's software is stopped", "hint": "Whoever stopped it starts it again."}
    if note and (unit is None or unit.is_starting or unit.pid in (0, note.pid)):
        return {
            "headline": "The probe does not start",
            "hint": "It is tried again every few seconds.",
            "faults": note.faults,
        }
    if unit is None or unit.is_starting:
        return {"headline": "The probe is starting", "hint": "This takes up to a minute."}
    return {
        "headline": "The probe does not start",
        "hint": "It is tried again every few seconds.",
        "faults": (_silent_end(unit, release).as_record(),),
        "log": _log(),
    }


def _silent_end(unit: UnitState, release: str) -> DeviceError:
    what = f"Release {release}" if release else "The probe's software"
    how = f"{unit.result}, {unit.status}" if unit.status else unit.result
    return DeviceError(
        f"{what} ended before it could say why ({how}).",
        "Switch the probe off and on; if that does not help, go back to the last good release.",
    )


def _releases(root: Path) -> tuple[str, str]:
    """Return the release that is to run, and the last good one beside it; each empty when it is not known."""
    release = linked_release(root)
    state = _record(root / NOTES / "state.json")
    committed, previous = (str(state.get(name) or "") for name in ("committed", "previous"))
    return release, committed if committed != release else previous


def _record(path: Path) -> Mapping[str, Any]:
    try:
        record = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def _unit() -> UnitState | None:
    """Return what systemd says of the daemon; None without systemd, or when it has no such unit."""
    names = "LoadState,ActiveState,Result,ExecMainStatus,ExecMainPID,MainPID"
    text = _said(["systemctl", "show", UNIT, f"--property={names}"])
    values = dict(line.partition("=")[::2] for line in text.splitlines())
    if values.get("LoadState") != "loaded":
        return None
    running = values.get("MainPID", "0") != "0"
    pid = values.get("MainPID" if running else "ExecMainPID", "0")
    status = values.get("ExecMainStatus", "")
    return UnitState(
        values.get("ActiveState", ""), values.get("Result", ""), status, int(pid) if pid.isdecimal() else 0
    )


def _log() -> tuple[str, ...]:
    """Return the last lines of the daemon's log."""
    text = _said(["journalctl", f"--unit={UNIT}", f"--lines={LOG_LINES}", "--output=cat", "--no-pager", "--quiet"])
    return tuple(text.splitlines()[-LOG_LINES:])


def _said(command: list[str]) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=COMMAND_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout if done.returncode == 0 else ""
