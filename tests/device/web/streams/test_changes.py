"""Changes as events: each once, in order, by ids with which a client comes back, also after a restart or a restore."""

import asyncio
import json

import pytest
from kept_measurements import keep

from device.errors import StorageError
from device.records.exams import ExamContent
from device.records.store import Store
from device.web.streams import changes
from device.web.streams.changes import ChangeFeed


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "var"


@pytest.fixture
def store(folder):
    opened = Store(folder)
    yield opened
    opened.close()


def make_exam(store):
    return store.exams.make(ExamContent(kind="patient", patient_ref="A-17", operator="Ada"))


def number_of(event_id):
    return int(event_id.partition(":")[0])


def told(feed):
    """Return what the feed tells now: kind and record, and the numbers."""

    async def tell():
        return [event async for event in feed.new()]

    events = asyncio.run(tell())
    return [(one.event, json.loads(one.raw_data)) for one in events], [number_of(one.id) for one in events]


def begun(store, known=None):
    feed = ChangeFeed(store, known)
    return feed, asyncio.run(feed.begin())


def test_what_is_made_and_changed_is_told_once_as_it_is_then(store):
    keep(store, 1)
    feed, _ = begun(store)
    assert told(feed) == ([], [])
    exam = make_exam(store)
    kept = keep(store, 2, exam_id=exam["id"])
    events, numbers = told(feed)
    assert events == [("exam", exam), ("measurement", kept)]
    store.exams.void("m-2", version=1, by="Ada", reason="Slipped")
    changed = store.exams.change(exam["id"], {"note": "x"}, version=1, by="Ada", reason="y")
    more, later = told(feed)
    assert more == [("measurement", store.measurement("m-2")), ("exam", changed)]
    assert numbers + later == sorted({*numbers, *later})
    assert told(feed) == ([], [])


def test_a_press_without_a_measurement_is_no_change(store):
    feed, _ = begun(store)
    store.save_press({"id": "p-9", "mode": "quick", "state": "cancelled", "measurement_id": None})
    assert told(feed) == ([], [])


def test_who_comes_back_gets_what_he_has_missed_also_after_a_restart(folder):
    first = Store(folder)
    keep(first, 1)
    feed, _ = begun(first)
    keep(first, 2)
    [(_, seen)], [number] = told(feed)
    known = str(first.audit.newest())
    assert number_of(known) == number
    assert seen["id"] == "m-2"
    keep(first, 3)
    first.close()
    again = Store(folder)
    feed, begun_at = begun(again, known)
    keep(again, 4)
    assert begun_at == known
    assert [record["id"] for _, record in told(feed)[0]] == ["m-3", "m-4"]
    again.close()


def test_who_was_away_for_long_gets_all_of_it_page_by_page(store, monkeypatch):
    monkeypatch.setattr(changes, "PAGE", 2)
    feed, _ = begun(store)
    for number in range(1, 6):
        keep(store, number)
    assert [record["id"] for _, record in told(feed)[0]] == [f"m-{number}" for number in range(1, 6)]


@pytest.mark.parametrize(
    "known",
    ["1", "0", "99999", "-1", "1" * 19, "1.0", "x", ":", "{hash}", "{seq}:", ":{hash}", "{seq}:x", "{seq}:{hash}0",
     "{seq}:{hash}:", "-{seq}:{hash}", "\u0661:{hash}", "1{seq}:{hash}", "0:{hash}", "1:" + "0" * 64, "{seq} :{hash}"],
)  # fmt: skip
def test_who_names_no_id_of_this_store_is_told_all(store, known):
    """A plain number is that of a release before."""
    keep(store, 1)
    newest = store.audit.newest()
    feed, begun_at = begun(store, known.format(seq=newest.seq, hash=newest.hash))
    assert begun_at == f"0:{'0' * 64}"
    keep(store, 2)
    assert [record["id"] for _, record in told(feed)[0]] == ["m-1", "m-2"]


def test_an_empty_id_is_none_and_spaces_around_one_are_none_of_it(store):
    keep(store, 1)
    newest = str(store.audit.newest())
    for known in (None, "", " ", f" {newest} "):
        feed, begun_at = begun(store, known)
        assert begun_at == newest
        assert told(feed) == ([], [])


def test_who_has_seen_nothing_of_a_new_store_is_told_of_its_first_record(store):
    _, begun_at = begun(store)
    keep(store, 1)
    again, _ = begun(store, begun_at)
    assert [record["id"] for _, record in told(again)[0]] == ["m-1"]


def test_nothing_is_read_while_nothing_is_written(store, monkeypatch):
    feed, _ = begun(store)
    told(feed)
    monkeypatch.setattr(store.listing, "changes", lambda **asked: pytest.fail("the store was read"))
    assert told(feed) == ([], [])


def test_a_store_that_cannot_be_read_is_asked_again_though_nothing_more_has_changed(store, monkeypatch):
    feed, _ = begun(store)
    read = store.listing.changes

    def gone(**asked):
        raise StorageError("The disk is gone.", "Check it.")

    monkeypatch.setattr(store.listing, "changes", gone)
    keep(store, 1)
    with pytest.raises(StorageError):
        told(feed)
    monkeypatch.setattr(store.listing, "changes", read)
    assert [record["id"] for _, record in told(feed)[0]] == ["m-1"]


def test_what_a_damaged_database_has_lost_is_told_to_nobody_and_all_else_is(store):
    made = make_exam(store)
    keep(store, 1)
    gone = make_exam(store)
    with store._transaction() as db:
        db.execute("DELETE FROM exam WHERE id = ?", (gone["id"],))
    later = make_exam(store)
    feed, _ = begun(store, "told all")
    events, _ = told(feed)
    assert [record["id"] for kind, record in events if kind == "exam"] == [made["id"], later["id"]]
