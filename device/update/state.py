"""What was decided, so that it outlives a power cut: which release is committed, which one is on trial, which are bad.

Written whole or not at all (device/files/durable.py); everybody may read it, only the updater writes it. After the way
back an older updater reads what a newer one wrote: it keeps what it does not know, and writes it again.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, TypeVar

from device.files.durable import write_durably
from device.update.layout import REMOVED, STAGED, UpdateLayout

log = logging.getLogger(__name__)
SCHEMA = "tsis.update_state/1"
"""Another number only where an updater of before would misread a field: then it knows no more than links and floor."""
MOST_HISTORY = 50
LARGEST_COUNTER = 2**53
OTHERS = "others"
LOST = "which releases failed is not known any more, and one of those at hand is the one to go back to"


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
    others: Mapping[str, Any] = field(default_factory=dict)
    """What a later updater wrote here and this one does not know."""


@dataclass(frozen=True)
class UpdateEvent:
    """One line of the history: what became of a release, when (UTC, as far as the clock knew), and why."""

    at: str
    release: str
    event: str
    reason: str = ""
    others: Mapping[str, Any] = field(default_factory=dict)
    """What a later updater wrote here and this one does not know."""


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
    others: Mapping[str, Any] = field(default_factory=dict)
    """What a later updater wrote here and this one does not know."""

    def as_record(self) -> dict[str, Any]:
        """Return the JSON object, in which what this updater does not know stands where it stood."""
        record = _lifted(asdict(self))
        pending, history = record["pending"], record["history"]
        return record | {"pending": pending and _lifted(pending), "history": [_lifted(event) for event in history]}

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
    """Return the state; where the file is missing or cannot be read, what links and releases tell, and say so."""
    try:
        return _from_record(_record(layout))
    except FileNotFoundError:
        return _recovered(layout, "is missing")
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return _recovered(layout, "could not be read")


def is_on_disk(layout: UpdateLayout, state: UpdateState) -> bool:
    """Return whether state.json says this."""
    try:
        return _from_record(_record(layout)) == state
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return False


def write_state(layout: UpdateLayout, state: UpdateState) -> None:
    """Write the state; when this returns it is on the disk. Raises `OSError`."""
    write_durably(layout.state, json.dumps({"schema": SCHEMA, **state.as_record()}, indent=1).encode())


def _record(layout: UpdateLayout) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(layout.state.read_bytes())
    return record


def _from_record(record: Mapping[str, Any]) -> UpdateState:
    """Return the state that a record says; raise one of the errors above for a record that is none."""
    own = {name: value for name, value in record.items() if name != "schema"}
    if record["schema"] != SCHEMA or _counter(own["floor"]) is None or not isinstance(own["bad"], dict):
        raise ValueError(f"not {SCHEMA}")
    pending = _made(PendingRelease, own["pending"]) if own["pending"] else None
    history = tuple(_made(UpdateEvent, event) for event in own["history"])
    return _made(UpdateState, own | {"pending": pending, "history": history})


StatePart = TypeVar("StatePart", PendingRelease, UpdateEvent, UpdateState)


def _made(kind: type[StatePart], record: Mapping[str, Any]) -> StatePart:
    known = {one.name for one in fields(kind)} - {OTHERS}
    values = {name: value for name, value in record.items() if name in known}
    return kind(**values, others={name: value for name, value in record.items() if name not in known})


def _lifted(record: dict[str, Any]) -> dict[str, Any]:
    others: dict[str, Any] = record[OTHERS]
    return {name: value for name, value in record.items() if name != OTHERS} | others


def _recovered(layout: UpdateLayout, why: str) -> UpdateState:
    """Return what is known without the file: the committed release is the updater's; nothing where there is none.

    The floor's release is always the committed or the previous one, so the highest counter on the disk is no less.
    """
    linked = (layout.linked(link) for link in (layout.updater, layout.current))
    committed = next((name for name in linked if name and layout.is_installed(name)), None)
    if committed is None:
        return UpdateState()
    counters = {name: counter for name in _installed(layout) if (counter := _counter_in(name)) is not None}
    floor = max([*counters.values(), _floor_in_file(layout)])
    previous = max(counters.keys() - {committed}, key=lambda name: counters[name], default=None)
    reason = f"state.json {why}: the floor is {floor} by the releases at hand; {LOST}"
    log.warning("%s", reason)
    return UpdateState(committed, previous, floor=floor).noted(committed, "recovered", reason)


def _installed(layout: UpdateLayout) -> list[str]:
    """Return the whole releases on the disk; the committed one is among them."""
    return [path.name for path in layout.releases.iterdir() if layout.is_installed(path.name)]


def _counter_in(name: str) -> int | None:
    """Return the counter in a folder's name, None for one that is no release's, or none yet."""
    try:
        return None if name.startswith((STAGED, REMOVED)) else counter_of(name)
    except ValueError:
        return None


def _floor_in_file(layout: UpdateLayout) -> int:
    """Return the floor of a file of another schema, 0 where it has none that could be one."""
    with suppress(OSError, ValueError, TypeError, KeyError):
        return _counter(_record(layout)["floor"]) or 0
    return 0


def _counter(value: object) -> int | None:
    return value if type(value) is int and 0 <= value <= LARGEST_COUNTER else None
