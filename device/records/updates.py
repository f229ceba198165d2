"""The releases of this probe as the updater tells of them, and the one door by which it is given a file.

The updater (`device.update`, root's) alone verifies, installs and decides; here its two files are read, and a release
file appears in its folder `incoming` by a rename, whole or not at all. Files that cannot be read count as not there.
"""

from __future__ import annotations

import errno
import json
import logging
import math
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from device import __version__
from device.errors import BodyTooLarge, BusyError, DiskFullError, NotSetUp, RolledBack, StorageError
from device.files.handed_over import PART, HandedOverFile, is_held

log = logging.getLogger(__name__)
Result = TypeVar("Result")

FOLDER = Path("/var/lib/tsis-update")
RELEASES = Path("/opt/tsis/releases")
HANDED_OVER, WAY_BACK = "update.release", "roll_back"
WAITING = "waiting"
"""State while a file is handed over and the updater has not said anything of it."""
UNDER_WAY = (WAITING, "verifying", "unpacking", "switching", "checking")
ENDS = ("committed", "rolled_back")
NOT_A_RELEASE = "not_installed"
"""State of a workstation, where nothing updates this software."""
HISTORY = 20
LARGEST_BYTES = 300_000_000
SPARE_BYTES = 50_000_000
"""Left for the measurements beside a release file."""
SYNC_EVERY_BYTES = 4_000_000


def release_of(prefix: Path) -> str:
    """Return the name of the release that runs in an environment; its version where that is no release's folder."""
    return prefix.name if prefix.parent == RELEASES else __version__


RUNNING = release_of(Path(sys.prefix).resolve())
"""The release of this process, looked up before an update can turn `current` to another one."""


@dataclass(frozen=True)
class UpdateRecord:
    """What the updater says: releases by name, how far an update is (0..1), how the last one ended, and before that.

    `pending` is a release on trial, `leaving` why it is just being left; `outcome` is the last end in words for the
    operator.
    """

    running: str
    state: str = NOT_A_RELEASE
    release: str | None = None
    previous: str | None = None
    committed: str | None = None
    pending: str | None = None
    leaving: str = ""
    floor: int | None = None
    progress: float | None = None
    step: str = ""
    reason: str = ""
    outcome: str = ""
    history: tuple[dict[str, Any], ...] = field(default=())

    @property
    def is_under_way(self) -> bool:
        """Whether an update is being installed or judged."""
        return self.state in UNDER_WAY

    @property
    def can_roll_back(self) -> bool:
        """Whether there is a release to go back to."""
        return self.previous not in (None, self.running) and not self.is_under_way

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON object."""
        return {**asdict(self), "can_roll_back": self.can_roll_back}


@dataclass(frozen=True)
class UpdateEnd:
    """How an update ended that was tried: `event` is one of `ENDS`."""

    event: str
    release: str | None
    reason: str


class Updates:
    """The updater's folder on a probe, which a workstation does not have."""

    def __init__(self, folder: Path = FOLDER, running: str = RUNNING) -> None:
        """Take the folder; `running` is the release of this process."""
        self._folder, self._incoming, self.running = folder, folder / "incoming", running
        self._taking: IncomingRelease | None = None

    def now(self) -> UpdateRecord:
        """Return what the updater says now."""
        state, progress = _read(self._folder / "state.json"), _read(self._folder / "progress.json")
        if not (state or progress):
            return UpdateRecord(self.running, reason="This software is not installed as a release.")
        history = tuple(one for one in _as(list, state.get("history")) or () if isinstance(one, dict))
        record = UpdateRecord(
            running=self.running,
            state=WAITING if self._is_waiting() else _as(str, progress.get("state")) or "idle",
            release=_name(progress.get("release")),
            previous=_name(state.get("previous")),
            committed=_name(state.get("committed")),
            pending=_name(state.get("pending")),
            leaving=_as(str, (_as(dict, state.get("pending")) or {}).get("leaving")) or "",
            floor=_as(int, state.get("floor")),
            progress=_ratio(progress.get("progress")),
            step=_as(str, progress.get("step")) or "",
            reason=_as(str, progress.get("reason")) or "",
            history=history[-HISTORY:],
        )
        return replace(record, outcome=_outcome(record))

    def warning(self) -> RolledBack | None:
        """Return what the screen shows until the next release is committed, if the last one was taken back."""
        record = self.now()
        last = _last_end(record)
        if not last or last.event != "rolled_back":
            return None
        return RolledBack(_failure(last), f"{_way_back(record)} Measure as before.")

    def require_free(self) -> None:
        """Raise `BusyError` while an update is under way, `NotSetUp` where there is no updater."""
        record = self.now()
        if not self._incoming.is_dir():
            raise NotSetUp("This software is not installed as a release.", "Update it as it was installed.")
        if record.is_under_way:
            raise BusyError(f"An update is under way: {record.step or record.state}.", "Wait until it has ended.")

    def _is_waiting(self) -> bool:
        """Return whether something was handed over of which the updater has not told anything yet."""
        handed_s = max(_changed_s(self._incoming / name) for name in (HANDED_OVER, WAY_BACK))
        return handed_s >= max(_changed_s(self._folder / "progress.json"), 0.0)

    def receive(self, announced_bytes: int | None) -> IncomingRelease:
        """Begin to take a release file of so many bytes, if that is known.

        Raises `BodyTooLarge` for one that is too large, `DiskFullError` when there is no space for it,
        `StorageError` when the folder cannot be written, and as `require_free`.
        """
        self.require_free()
        if self._taking and self._taking.is_open:
            raise BusyError("Another file is being taken.", "Wait until it has arrived.")
        for path in self._incoming.glob(f"{PART}*"):
            _remove_unless_held(path)
        require_size(announced_bytes or 0)
        space = os.statvfs(self._incoming)
        left_bytes = space.f_bavail * space.f_frsize - SPARE_BYTES
        if left_bytes < (announced_bytes or 0):
            cause = f"A release of {announced_bytes} bytes does not fit: {max(left_bytes, 0)} bytes are left for it."
            raise DiskFullError(cause, "Copy recordings away and delete them there.")
        self._taking = _on_disk(lambda: IncomingRelease(self._incoming))
        return self._taking

    def ask_to_roll_back(self) -> None:
        """Ask the updater for the release before; raise as `require_free`, `NotSetUp` when there is none."""
        self.require_free()
        if not self.now().can_roll_back:
            raise NotSetUp("There is no release before this one on the probe.", "Install another one.")
        _on_disk(lambda: IncomingRelease(self._incoming).hand_over(WAY_BACK))


class IncomingRelease:
    """A file that is being taken: not there for the updater until it is handed over."""

    def __init__(self, folder: Path) -> None:
        """Begin it in the updater's folder. Raises `OSError`."""
        self._file, self._unsynced_bytes = HandedOverFile(folder), 0

    @property
    def bytes_taken(self) -> int:
        """How much has come."""
        return self._file.bytes_written

    @property
    def is_open(self) -> bool:
        """Whether it is still being taken."""
        return self._file.is_open

    def write(self, part: bytes) -> None:
        """Append; raise `BodyTooLarge` when it grows too large, `StorageError` when the disk refuses it.

        Synchronised every few megabytes: what is written at the end of a press must not wait behind all of it.
        """
        require_size(self.bytes_taken + len(part))
        _on_disk(lambda: self._file.write(part))
        self._unsynced_bytes += len(part)
        if self._unsynced_bytes >= SYNC_EVERY_BYTES:
            self.synchronise()

    def synchronise(self) -> None:
        """Bring what was written to the disk; raise `StorageError` when that refuses it."""
        self._unsynced_bytes = 0
        _on_disk(self._file.synchronise)

    def hand_over(self, name: str = HANDED_OVER) -> None:
        """Bring it to the disk and give it the name that the updater waits for; raise `BusyError` when one is there."""
        try:
            _on_disk(lambda: self._file.hand_over(name))
        except FileExistsError:
            raise BusyError("An update is under way: another file waits for it.", "Wait until it has ended.") from None

    def discard(self) -> None:
        """Remove it, if it was not handed over."""
        self._file.discard()


def require_size(size_bytes: int) -> None:
    """Raise `BodyTooLarge` for a release file that is larger than any can be."""
    if size_bytes > LARGEST_BYTES:
        cause = f"The file has {size_bytes} bytes, but a release file has at most {LARGEST_BYTES}."
        raise BodyTooLarge(cause, "Send the file that `make bundle` built.")


def _on_disk(action: Callable[[], Result]) -> Result:
    """Return what an action returns; raise `StorageError`, or `DiskFullError`, when the disk refuses it."""
    try:
        return action()
    except FileExistsError:
        raise
    except OSError as error:
        kind = DiskFullError if error.errno in (errno.ENOSPC, errno.EDQUOT) else StorageError
        remedy = "Free space on the disk, or update from its command line: python -m device update install FILE."
        raise kind(f"The release could not be written: {error}.", remedy) from error


def _remove_unless_held(path: Path) -> None:
    """Remove what an upload left that nobody goes on with; another door of the probe may be taking its own."""
    with suppress(OSError):
        if not is_held(path):
            path.unlink()


def _read(path: Path) -> dict[str, Any]:
    """Return a JSON object of the updater; an empty one when there is none, or none that can be read."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, RecursionError) as error:
        log.warning("%s cannot be read: %s", path, error)
        return {}
    return content if isinstance(content, dict) else {}


def _changed_s(path: Path) -> float:
    """Return when a file was last changed (s since 1970), long ago for one that is not there."""
    try:
        return path.stat().st_mtime
    except OSError:
        return -math.inf


def _as(kind: type[Result], value: object) -> Result | None:
    return value if isinstance(value, kind) and not isinstance(value, bool) else None


def _name(value: object) -> str | None:
    """Return the name of a release, which stands alone or, of one on trial, in a record."""
    if isinstance(value, dict):
        value = value.get("release")
    return value if isinstance(value, str) and value else None


def _ratio(value: object) -> float | None:
    number = _as(float, value) if isinstance(value, float) else _as(int, value)
    return None if number is None or not 0.0 <= number <= 1.0 else float(number)


def _last_end(record: UpdateRecord) -> UpdateEnd | None:
    """Return how the last update ended that was tried on this probe; a file that was refused was not tried.

    The updater starts the daemon of before first and adds to its history then.
    """
    if record.leaving:
        return UpdateEnd("rolled_back", record.pending, record.leaving)
    told = {"event": record.state, "release": record.release, "reason": record.reason}
    for entry in (*reversed(record.history), told):
        if entry.get("event") in ENDS:
            return UpdateEnd(entry["event"], _name(entry.get("release")), _as(str, entry.get("reason")) or "")
    return None


def _outcome(record: UpdateRecord) -> str:
    """Return how the last update ended, in one sentence or two for the operator."""
    if record.state == "refused":
        what = f"Version {_version(record.release)}" if record.release else "The file"
        return f"{what} was refused: {_unstopped(record.reason)}. Nothing was changed."
    end = _last_end(record)
    if end is None:
        return ""
    if end.event == "committed":
        return f"Version {_version(end.release)} is installed and works."
    return f"{_failure(end)} {_way_back(record)}"


def _failure(end: UpdateEnd) -> str:
    return f"Version {_version(end.release)} did not work: {_unstopped(end.reason)}."


def _way_back(record: UpdateRecord) -> str:
    return f"This probe went back to {_version(record.running)}."


def _version(release: str | None) -> str:
    """Return what an operator calls a release: its version without the counter behind it."""
    return (release or "?").partition("+")[0]


def _unstopped(reason: str) -> str:
    return reason.strip().rstrip(".") or "it gave no reason"
