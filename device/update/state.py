"""What was decided, so that it outlives a power cut: which release is committed, which one is on trial, which are bad.

Written whole or not at all (device/files/durable.py); everybody may read it, only the updater writes it.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from device.files.durable import write_durably
from device.update.layout import UpdateLayout
from device.update.manifest import read_installed

SCHEMA = "tsis.update_state/1"
MOST_HISTORY = 50


@dataclass(frozen=True)
class PendingRelease:
    """A release on trial: it is committed when it is healthy, or left for the committed one."""

    release: str
    tries: int = 0
    """How often the machine was started with it."""
    baseline: dict[str, str | None] | None = None
    """The parts that were not ready before the switch, with their codes; None when the daemon did not answer."""
    lacking: str = ""
    """For which codes of its machine the daemon before the switch did not start, in one text."""
    is_roll_back: bool = False
    """Whether an operator asked for it: the previous release, not a new one."""
    leaving: str = ""
    """Why it is being left, once that is decided; a return that was interrupted goes on."""
    is_bad: bool = False
    """Whether it is left because of itself, and not because of a full disk: then it is not tried again."""


@dataclass(frozen=True)
class UpdateEvent:
    """One line of the history: what became of a release, when (UTC, as far as the clock knew), and why."""

    at: str
    release: str
    event: str
    reason: str = ""


@dataclass(frozen=True)
class UpdateState:
    """The whole of state.json."""

    committed: str | None = None
    previous: str | None = None
    pending: PendingRelease | None = None
    floor: int = 0
    """The largest counter that was ever committed: nothing at or below it is installed."""
    bad: dict[str, str] = field(default_factory=dict)
    """Releases that were left, with the reason: none with such a counter is tried again."""
    history: tuple[UpdateEvent, ...] = ()
    is_finishing: bool = False
    """Whether what follows a commit is still to be done: updater's link, keys, old releases."""

    def noted(self, release: str, event: str, reason: str = "") -> UpdateState:
        """Return the state with one more line of history."""
        at = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        return replace(self, history=(*self.history, UpdateEvent(at, release, event, reason))[-MOST_HISTORY:])

    def keeps(self) -> set[str]:
        """Return the releases that stay on the disk."""
        pending = self.pending.release if self.pending else None
        return {name for name in (self.committed, self.previous, pending) if name}


def counter_of(release: str) -> int:
    """Return the counter in the name of a release, `<version>+<counter>`."""
    return int(release.rpartition("+")[2])


def read_state(layout: UpdateLayout) -> UpdateState:
    """Return the state; where the file is missing or damaged, what the links tell."""
    try:
        return _from_record(json.loads(layout.state.read_bytes()))
    except FileNotFoundError:
        return _from_links(layout)
    except (OSError, ValueError, TypeError, KeyError):
        found = _from_links(layout)
        return found.noted(found.committed or "", "recovered", "state.json could not be read")


def is_on_disk(layout: UpdateLayout, state: UpdateState) -> bool:
    """Return whether state.json says this."""
    try:
        return _from_record(json.loads(layout.state.read_bytes())) == state
    except (OSError, ValueError, TypeError, KeyError):
        return False


def write_state(layout: UpdateLayout, state: UpdateState) -> None:
    """Write the state; when this returns it is on the disk. Raises `OSError`."""
    write_durably(layout.state, json.dumps({"schema": SCHEMA, **asdict(state)}, indent=1).encode())


def _from_record(record: dict[str, Any]) -> UpdateState:
    if record.pop("schema") != SCHEMA:
        raise ValueError(f"not {SCHEMA}")
    pending = PendingRelease(**record.pop("pending")) if record["pending"] else record.pop("pending")
    history = tuple(UpdateEvent(**event) for event in record.pop("history"))
    return UpdateState(**record, pending=pending, history=history)


def _from_links(layout: UpdateLayout) -> UpdateState:
    """Return what is known without the file: the committed release is the updater's, its counter the floor."""
    for link in (layout.updater, layout.current):
        name = layout.linked(link)
        if name and layout.is_installed(name):
            return UpdateState(committed=name, floor=read_installed(layout, name).counter)
    return UpdateState()
