"""Measurements that no backup holds for too long are warned of; a probe that has none, or saves them, is quiet."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from probe_card import RECORDING

from device.errors import ClockJumpError
from device.instrument.watch.backup_watch import BackupWatch
from device.records.audit import recorded
from device.records.saved import SAVED, Unsaved
from device.records.store import Store

OTHER = ClockJumpError("The clock was set by +3600.0 s.", "Check it.")


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with closing(Store(tmp_path)) as opened:
        yield opened


def days_ago(days: float) -> str:
    return recorded(datetime.now(UTC) - timedelta(days=days))


def take(store: Store, number: int, at: str) -> None:
    record = {"id": f"m-{number}", "recording_id": f"r-{number}", "taken_at": at}
    store.add_measurement(record, replace(RECORDING, id=f"r-{number}"))


def save(store: Store, until: int, made_at: str) -> None:
    said = {"made_at": made_at, "newest_seq": until, "newest_id": f"m-{until}", "left_out": []}
    (store.folder / SAVED).write_text(json.dumps(said))


def codes(watch: BackupWatch) -> list[str]:
    return [one.code for one in watch.warned([])]


def test_what_no_backup_holds_for_too_long_is_warned_of_until_there_is_one(store: Store) -> None:
    watch = BackupWatch(store, 30.0, every_s=0.0)
    assert watch.warned([OTHER]) == (OTHER,)  # a new probe
    take(store, 1, days_ago(29))
    assert watch.warned([OTHER]) == (OTHER,)
    store._db.execute("UPDATE measurement SET record = json_set(record, '$.taken_at', ?)", (since := days_ago(31),))
    take(store, 2, days_ago(0))
    other, overdue = watch.warned([OTHER])
    assert other is OTHER
    assert (overdue.code, overdue.severity, overdue.is_lasting) == ("E607", "warning", True)
    assert overdue.cause == f"Measurements since {since[:10]} are in no backup, for more than 30 days."
    take(store, 3, days_ago(0))
    assert watch.warned([OTHER, overdue]) == (OTHER, overdue)  # one more press is no other warning
    save(store, 3, days_ago(0))
    assert watch.warned([OTHER, overdue]) == (OTHER,)


def test_a_measurement_is_unsaved_since_the_backup_before_it_at_most(store: Store) -> None:
    """A clock that was years behind when it was taken makes no backup overdue that was made yesterday."""
    take(store, 1, days_ago(60))
    save(store, 1, made_at := days_ago(20))
    take(store, 2, days_ago(900))
    assert store.unsaved() == Unsaved(1, made_at, made_at)
    assert codes(BackupWatch(store, 30.0)) == []
    assert codes(BackupWatch(store, 19.0)) == ["E607"]


@pytest.mark.parametrize("at", ["1970-01-01T00:01:00.000Z", "2999-01-01T00:00:00.000Z"])
def test_a_clock_that_was_not_set_warns_of_nothing(store: Store, at: str) -> None:
    take(store, 1, at)
    assert store.unsaved() == Unsaved(1, None, None)
    assert codes(BackupWatch(store, 1.0)) == []


def test_it_can_be_switched_off_and_asks_the_database_seldom(store: Store) -> None:
    take(store, 1, days_ago(400))
    assert codes(BackupWatch(store, 0.0)) == []
    watch = BackupWatch(store, 30.0)
    assert codes(watch) == ["E607"]
    save(store, 1, days_ago(0))
    assert codes(watch) == ["E607"]  # until it looks again


@pytest.mark.parametrize(
    "said", ["no JSON", '{"made_at": "yesterday", "newest_seq": 1, "newest_id": "m-1", "left_out": []}']
)
def test_a_note_that_cannot_be_read_is_no_backup(store: Store, said: str) -> None:
    take(store, 1, days_ago(40))
    (store.folder / SAVED).write_text(said)
    assert store.unsaved().saved_at is None
    assert codes(BackupWatch(store, 30.0)) == ["E607"]
