"""A rule deletes what it says and nothing else: shown before, written down with why, and only what a backup holds."""

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest
from probe_card import RECORDING

from device.errors import DeletedRecording
from device.instrument.watch.recordings_watch import RecordingsWatch
from device.records.disk import LocalDisk
from device.records.exams import ExamContent
from device.records.outbox import OutboxItem
from device.records.retention import RetentionRule
from device.records.saved import SAVED
from device.records.store import Store

DAYS_OLD = {1: 400, 2: 100, 3: 20, 4: 1}


def taken_at(days_old):
    return (datetime.now(UTC) - timedelta(days=days_old)).isoformat(timespec="milliseconds").replace("+00:00", "Z")


class DiskOfOurOwn(LocalDisk):
    """Has 30 MB left whatever is written: on the machine's own disk other programs write and delete meanwhile."""

    def free_bytes(self, folder):
        return 30_000_000


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path, DiskOfOurOwn())
    for number, days_old in DAYS_OLD.items():
        take(opened, number, taken_at(days_old))
    yield opened
    opened.close()


def save(store, until=4, left_out=()):
    said = {"made_at": taken_at(0), "newest_seq": until, "newest_id": f"m-{until}", "left_out": list(left_out)}
    (store.folder / SAVED).write_text(json.dumps(said))


def clock(*, is_steady=True):
    return SimpleNamespace(is_steady=is_steady)


def take(store, number, at):
    record = {"id": f"m-{number}", "recording_id": f"r-{number}", "taken_at": at}
    store.add_measurement(record, replace(RECORDING, id=f"r-{number}"))


def names(plan):
    return [one.recording_id for one in plan.removals]


def files(store):
    return sorted(path.stem for path in (store.folder / "recordings").iterdir())


def test_without_a_rule_nothing_is_ever_deleted(store):
    save(store)
    assert names(store.retention.carry_out(RetentionRule())) == []
    assert files(store) == ["r-1", "r-2", "r-3", "r-4"]


def test_what_the_hospitals_archive_has_not_got_yet_stays(store):
    save(store)
    exam = store.exams.make(ExamContent(kind="patient", patient_ref="A-17", operator="Ada"))
    store.outbox.add(exam["id"], [OutboxItem("2.25.1", exam["id"], "m-1", 1, 1, {})], by="Ada", exam_version=1)
    rule = RetentionRule(keep_days=90)
    assert names(store.retention.plan(rule)) == ["r-2"]
    store.outbox.settle("2.25.1", "confirmed")
    assert names(store.retention.plan(rule)) == ["r-1", "r-2"]


def test_what_is_older_is_shown_and_then_deleted_while_its_numbers_stay(store):
    save(store)
    rule = RetentionRule(keep_days=90)
    shown = store.retention.plan(rule)
    assert names(shown) == ["r-1", "r-2"]
    assert {one.why for one in shown.removals} == {"older than 90 days"}
    assert shown.as_record()["size_bytes"] == sum(
        store.recordings.place_of(name).stat().st_size for name in ("r-1", "r-2")
    )
    assert files(store) == ["r-1", "r-2", "r-3", "r-4"]
    assert store.retention.carry_out(rule) == shown
    assert files(store) == ["r-3", "r-4"]
    assert store.measurement("m-1")["seq"] == 1
    assert names(store.retention.plan(rule)) == []


def test_what_no_backup_holds_is_held_back_unless_the_rule_says_otherwise(store):
    rule = RetentionRule(keep_days=10)
    unsaved = store.retention.plan(rule)
    assert (names(unsaved), unsaved.held_back, unsaved.saved_at) == ([], 3, None)
    save(store, until=2, left_out=["r-1"])
    partly = store.retention.plan(rule)
    assert (names(partly), partly.held_back) == (["r-2"], 2)
    assert names(store.retention.plan(replace(rule, saved_first=False))) == ["r-1", "r-2", "r-3"]


@pytest.mark.parametrize("said", ["", "[]", '{"made_at": "x"}', '{"made_at": 1, "newest_seq": "x"}'])
def test_a_note_of_a_backup_that_cannot_be_read_is_none(store, said):
    (store.folder / SAVED).write_text(said)
    assert names(store.retention.plan(RetentionRule(keep_days=10))) == []


def test_a_backup_of_another_database_counts_for_nothing(store):
    save(store)
    (store.folder / SAVED).write_text((store.folder / SAVED).read_text().replace('"m-4"', '"m-9"'))
    assert names(store.retention.plan(RetentionRule(keep_days=10))) == []


def test_for_space_the_oldest_go_until_there_is_enough(store):
    save(store)
    size_mb = store.recordings.place_of("r-1").stat().st_size / 1e6
    wanted = RetentionRule(free_mb=store.free_mb + 1.5 * size_mb)
    plan = store.retention.plan(wanted)
    assert names(plan) == ["r-1", "r-2"]
    assert plan.removals[0].why.startswith("less than")
    assert names(store.retention.plan(RetentionRule(free_mb=store.free_mb))) == []


def test_what_is_held_back_makes_no_space_so_that_the_next_ones_go(store):
    """The oldest is in no backup, as one that was damaged when it was made: the rule must not wait for it for ever."""
    save(store, left_out=["r-1"])
    size_mb = store.recordings.place_of("r-1").stat().st_size / 1e6
    plan = store.retention.plan(RetentionRule(free_mb=store.free_mb + 0.5 * size_mb))
    assert (names(plan), plan.held_back) == (["r-2"], 1)


def test_what_was_deleted_says_when_and_why_and_is_in_the_audit(store):
    save(store)
    store.retention.carry_out(RetentionRule(keep_days=200))
    with pytest.raises(DeletedRecording, match="r-1 was deleted at .*: older than 200 days"):
        store.recording_path("r-1")
    [entry] = store.audit.entries(subject="m-1", before_seq=99, limit=9)
    assert (entry["what"], entry["reason"]) == ("recording_deleted", "older than 200 days")
    assert store.audit.warning() is None


def test_a_start_finishes_what_a_kill_left_of_it_and_misses_nothing(store, monkeypatch):
    save(store)
    monkeypatch.setattr(store.recordings, "remove", lambda name: None)
    store.retention.carry_out(RetentionRule(keep_days=200))
    assert files(store) == ["r-1", "r-2", "r-3", "r-4"]
    store.close()
    again = Store(store.folder)
    again.close()
    assert files(again) == ["r-2", "r-3", "r-4"]
    assert again.findings.warnings() == ()


def test_the_daemon_carries_the_rule_out_by_itself_once_an_hour(store):
    save(store)
    watch = RecordingsWatch(store, clock(), RetentionRule(keep_days=200))
    watch.retain()
    assert files(store) == ["r-2", "r-3", "r-4"]
    store._db.execute("UPDATE measurement SET record = json_set(record, '$.taken_at', '2000-01-01T00:00:00.000Z')")
    watch.retain()
    assert files(store) == ["r-2", "r-3", "r-4"]


def test_by_age_nothing_goes_until_the_clock_has_been_steady_for_a_while(store):
    """A board without a battery starts at an old date; a wrong time server makes everything old at once."""
    save(store)
    doubted = clock(is_steady=False)
    watch = RecordingsWatch(store, doubted, RetentionRule(keep_days=200))
    watch.retain()
    assert files(store) == ["r-1", "r-2", "r-3", "r-4"]
    doubted.is_steady = True
    watch.retain()
    assert files(store) == ["r-2", "r-3", "r-4"]


def test_while_the_clock_is_doubted_the_oldest_still_make_space(store):
    save(store)
    watch = RecordingsWatch(store, clock(is_steady=False), RetentionRule(keep_days=1, free_mb=store.free_mb + 0.001))
    watch.retain()
    assert files(store) == ["r-2", "r-3", "r-4"]


def test_what_was_taken_while_the_clock_showed_1970_is_no_older_than_what_was_kept_before_it(store):
    take(store, 5, "1970-01-01T00:03:00.000Z")
    save(store, until=5)
    assert names(store.retention.plan(RetentionRule(keep_days=10))) == ["r-1", "r-2", "r-3"]


def test_a_clock_that_once_ran_ahead_keeps_nothing_for_ever(store):
    take(store, 5, taken_at(-9000))
    take(store, 6, taken_at(0))
    save(store, until=6)
    assert names(store.retention.plan(RetentionRule(keep_days=10))) == ["r-1", "r-2", "r-3"]
    store._db.execute(
        "UPDATE measurement SET record = json_set(record, '$.taken_at', ?) WHERE id = 'm-6'", (taken_at(50),)
    )
    assert names(store.retention.plan(RetentionRule(keep_days=0.5))) == ["r-1", "r-2", "r-3", "r-4", "r-5", "r-6"]
