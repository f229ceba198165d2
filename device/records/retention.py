"""Which recordings a rule deletes, and what it would delete now: by age, or for space, and only what a backup holds.

A recording is most of what a press takes; its measurement, picture of numbers and audit stay for ever. First it is
written down that a recording is deleted, and why, in one transaction with the audit; then its file goes. Without a
rule nothing is ever deleted. A recording is as old as it says, or as one that was kept before it says, if that is less:
a clock may have shown 1970, an order cannot.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any, NamedTuple

from device.records.audit import append, recorded, utc_now
from device.records.manifest import manifest_of, note_removed
from device.records.recordings import KeptRecordings
from device.records.saved import SavedUntil, saved_until


@dataclass(frozen=True)
class RetentionRule:
    """When a recording may go: older than some days, or while less than `free_mb` (1e6 bytes) is left; None is never.

    `saved_first`: only what a backup holds.
    """

    keep_days: float | None = None
    free_mb: float | None = None
    saved_first: bool = True

    @property
    def is_any(self) -> bool:
        """Whether anything is ever deleted."""
        return self.keep_days is not None or self.free_mb is not None


@dataclass(frozen=True)
class Removal:
    """One recording that is to go, of which measurement, its size (bytes), and why."""

    recording_id: str
    measurement_id: str
    taken_at: str
    size_bytes: int
    why: str


@dataclass(frozen=True)
class RetentionPlan:
    """What the rule deletes now, oldest first. `held_back`: recordings that it would, were they in a backup."""

    rule: RetentionRule
    saved_at: str | None
    removals: tuple[Removal, ...]
    held_back: int

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON object."""
        size_bytes = sum(one.size_bytes for one in self.removals)
        return {**asdict(self), "size_bytes": size_bytes, "removals": [asdict(one) for one in self.removals]}


class _Kept(NamedTuple):
    """A recording that is kept, its measurement's number, and since when at most (RFC 3339, empty: nobody knows)."""

    seq: int
    recording: Removal
    not_before: str


class Retention:
    """Plans and deletes on a store's recordings. All methods may be called from any thread."""

    def __init__(
        self,
        folder: Path,
        transaction: Callable[[], AbstractContextManager[sqlite3.Connection]],
        recordings: KeptRecordings,
        free_mb: Callable[[], float],
    ) -> None:
        self._folder, self._transaction, self._recordings, self._free_mb = folder, transaction, recordings, free_mb

    def plan(self, rule: RetentionRule) -> RetentionPlan:
        """Return what the rule deletes now; changes nothing. Raises `StorageError` when nobody can say."""
        now = utc_now()
        with self._transaction() as db:
            kept, saved = _kept_recordings(db, now), saved_until(db, self._folder)
        free_mb = self._free_mb() if rule.free_mb is not None else 0.0
        may = [(one, not rule.saved_first or _is_saved(one, saved)) for one in kept]
        removals, held_back = _due(may, rule, now, free_mb)
        return RetentionPlan(rule, saved.made_at if saved else None, tuple(removals), held_back)

    def carry_out(self, rule: RetentionRule) -> RetentionPlan:
        """Delete what the rule deletes now, oldest first; return what that was."""
        plan = self.plan(rule)
        for one in plan.removals:
            with self._transaction() as db:
                note_removed(db, one.recording_id, one.why)
                append(db, "recording_deleted", one.measurement_id, reason=one.why, after=asdict(one))
            self._recordings.remove(one.recording_id)
        return plan


KEPT = """
SELECT seq, id, recording_id, taken_at, not_before FROM (
    SELECT *, max(CASE WHEN taken_at <= ? THEN taken_at END) OVER (ORDER BY seq) AS not_before FROM (
        SELECT seq, id, json_extract(record, '$.recording_id') AS recording_id,
            json_extract(record, '$.taken_at') AS taken_at
        FROM measurement
    )
)
WHERE id NOT IN (SELECT measurement_id FROM outbox WHERE state IN ('queued', 'sent', 'refused')) ORDER BY seq
"""


def _kept_recordings(db: sqlite3.Connection, now: str) -> list[_Kept]:
    """Return every recording that is kept and not needed for the archive, by its measurement's number, oldest first.

    What was taken after `now` was so by another clock, and says nothing of those kept after it.
    """
    manifest = manifest_of(db)
    return [
        _Kept(seq, Removal(recording, name, taken_at or "", manifest[recording].fingerprint.size_bytes, ""), at or "")
        for seq, name, recording, taken_at, at in db.execute(KEPT, (now,))
        if recording in manifest and not manifest[recording].removed
    ]


def _due(
    kept: Sequence[tuple[_Kept, bool]], rule: RetentionRule, now: str, free_mb: float
) -> tuple[list[Removal], int]:
    """Return what a rule deletes, with the reason: what is too old, and then the oldest until there is space.

    Each comes with whether it may go; of the others it is told how many the rule would delete, and none makes space.
    """
    before = _days_before(now, rule.keep_days) if rule.keep_days is not None else ""
    due, held_back, wanted_bytes = list[Removal](), 0, ((rule.free_mb or 0.0) - free_mb) * 1e6
    for (_, one, not_before), may_go in kept:
        if not_before and not_before < before:
            why = f"older than {rule.keep_days:g} days"
        elif wanted_bytes > 0.0:
            why = f"less than {rule.free_mb:g} MB left"
        else:
            continue
        if may_go:
            wanted_bytes -= one.size_bytes
            due.append(replace(one, why=why))
        else:
            held_back += 1
    return due, held_back


def _days_before(now: str, days: float) -> str:
    return recorded(datetime.fromisoformat(now) - timedelta(days=days))


def _is_saved(one: _Kept, saved: SavedUntil | None) -> bool:
    return saved is not None and one.seq <= saved.newest_seq and one.recording.recording_id not in saved.left_out
