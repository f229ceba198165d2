"""Every change gets to the address, in order and never unsigned, whatever is down or killed on the way."""

import random
import subprocess
import sys

import pytest
from daemon_process import ROOT, wait_for
from hurried_sender import hurry
from notice_receiver import NoticeReceiver, write_secret
from written_exam import begin, measure

from device.config import WebhookSection
from device.errors import DeviceError
from device.records.store import Store
from device.sending import persistent_sender
from device.webhook.notifier import WHOM, Notifier


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


@pytest.fixture
def receiver():
    made = NoticeReceiver()
    yield made
    made.close()


@pytest.fixture
def notifying(store, tmp_path, monkeypatch):
    """Begin to tell of a store; return the notifier and the faults that it told."""
    monkeypatch.setattr(persistent_sender, "FIRST_WAIT_S", 0.02)
    monkeypatch.setattr(persistent_sender, "BUSY_LOOK_S", 0.02)
    monkeypatch.setattr(Notifier, "look_s", 0.02)
    begun, secret = [], write_secret(tmp_path)

    def beginning(url, is_busy=lambda: False, secret_file=secret):
        told = []
        notifier = Notifier(WebhookSection(url=url, secret_file=secret_file), store, "S", told.append, is_busy)
        notifier.start()
        begun.append(notifier)
        return notifier, told

    yield beginning
    for notifier in begun:
        notifier.close()


def test_what_is_done_is_told_in_its_order_and_nothing_of_before(store, receiver, notifying):
    begin(store)
    notifier, _ = notifying(receiver.url)
    exam = begin(store)
    measured = measure(store, exam)
    store.exams.move(measured["id"], None, version=1, by="Ada", reason="Mistaken")
    store.exams.void(measured["id"], version=2, by="Ada", reason="Slipped")
    wait_for(lambda: len(receiver.taken), lambda number: number == 3)
    assert receiver.types() == ["exam.made", "measurement.moved", "measurement.voided"]
    assert {one["path"] for one in receiver.taken} == {"/tsis"}
    wait_for(notifier.as_record, lambda said: said["told"] == said["newest"] and said["fault"] is None)


def test_an_address_that_is_down_is_told_of_and_gets_all_once_it_is_there(store, notifying):
    """Its port is found free, left, and taken later."""
    found = NoticeReceiver()
    found.close()
    notifier, told = notifying(found.url)
    exam = begin(store)
    for _ in range(3):
        store.exams.void(measure(store, exam)["id"], version=1, by="Ada", reason="Slipped")
    fault = wait_for(lambda: [one for one in told if one], bool)[0]
    assert (fault.code, notifier.as_record()["fault"]["code"]) == ("E032", "E032")
    wait_for(lambda: len(told), lambda number: number >= 4)
    there = NoticeReceiver(found.port)
    try:
        wait_for(lambda: len(there.taken), lambda number: number == 4)
        wait_for(lambda: told[-1], lambda last: last is None)
    finally:
        there.close()
    assert there.types() == ["exam.made", *["measurement.voided"] * 3]


def test_an_address_that_is_down_for_two_hours_gets_all_in_their_order(store, tmp_path):
    """The hours are the notifier's own: what it waits is added up, and takes no time."""
    found = NoticeReceiver()
    found.close()
    secret = write_secret(tmp_path)
    notifier = Notifier(WebhookSection(url=found.url, secret_file=secret), store, "S")
    waiting = hurry(notifier)
    notifier.start()
    try:
        exam = begin(store)
        for _ in range(5):
            store.exams.void(measure(store, exam)["id"], version=1, by="Ada", reason="Slipped")
        wait_for(lambda: sum(waiting.waited_s), lambda seconds: seconds >= 2 * 3600.0)
        there = NoticeReceiver(found.port)
        try:
            wait_for(lambda: len(there.taken), lambda number: number == 6)
        finally:
            there.close()
    finally:
        notifier.close()
    assert there.ids() == [change.hash for change in store.listing.changes(after=0, limit=99)]


def test_what_is_not_taken_is_sent_again_under_its_id_and_nothing_overtakes_it(store, receiver, notifying):
    receiver.status = 500
    notifying(receiver.url)
    exam = begin(store)
    begin(store)
    wait_for(lambda: receiver.asked, lambda number: number >= 3)
    receiver.status = 204
    wait_for(lambda: len(receiver.taken), lambda number: number == 2)
    entries = [one for one in store.audit.entries(before_seq=99, limit=99) if one["what"] == "exam_made"]
    assert receiver.ids() == [one["hash"] for one in reversed(entries)]
    assert receiver.taken[0]["data"]["id"] == exam["id"]


def test_nothing_is_told_while_the_probe_is_pressed_and_all_after_that(store, receiver, notifying):
    looks, is_free = [], []
    notifying(receiver.url, lambda: looks.append(1) or not is_free)
    begin(store)
    wait_for(lambda: len(looks), lambda number: number >= 3)
    assert receiver.asked == 0
    is_free.append(1)
    wait_for(lambda: len(receiver.taken), lambda number: number == 1)


def test_without_its_secret_nothing_is_sent(store, receiver, notifying, tmp_path):
    _, told = notifying(receiver.url, secret_file=tmp_path / "later" / "webhook.secret")
    begin(store)
    assert wait_for(lambda: [one for one in told if one], bool)[0].code == "E032"
    assert receiver.asked == 0
    (tmp_path / "later").mkdir()
    write_secret(tmp_path / "later")
    wait_for(lambda: len(receiver.taken), lambda number: number == 1)


def test_a_stop_waits_for_no_address_that_is_silent(store, receiver, notifying):
    receiver.is_silent = True
    notifier, _ = notifying(receiver.url)
    begin(store)
    wait_for(lambda: receiver.asked, bool)
    assert notifier._thread.daemon
    notifier.close()
    assert store.listing.told(WHOM) == 0


def test_waiting_grows_up_to_a_bound():
    waits = [persistent_sender.wait_s(failures) for failures in range(1, 13)]
    assert waits[:4] == [2, 4, 8, 16]
    assert waits[-1] == persistent_sender.LONGEST_WAIT_S


def test_whatever_goes_wrong_does_not_end_the_thread(store, receiver, notifying, monkeypatch):
    notifier, told = notifying(receiver.url)
    monkeypatch.setattr(notifier._address, "post", lambda *_: 1 / 0)
    begin(store)
    fault = wait_for(lambda: [one for one in told if one], bool)[0]
    assert isinstance(fault, DeviceError)
    monkeypatch.undo()
    wait_for(lambda: len(receiver.taken), lambda number: number == 1)


def test_kills_lose_no_notice_and_change_no_order(store, tmp_path):
    exam, secret = begin(store), write_secret(tmp_path)
    store.listing.note_told(WHOM, 0)
    for _ in range(12):
        store.exams.void(measure(store, exam)["id"], version=1, by="Ada", reason="Slipped")
    wanted = [change.hash for change in store.listing.changes(after=0, limit=99)]
    store.close()
    rng, receiver = random.Random(1), NoticeReceiver()
    command = [sys.executable, "-m", "notifying_process", str(store.folder), receiver.url, str(secret)]
    path = f"{ROOT}:{ROOT / 'tests'}"
    try:
        for _ in range(4):
            before = len(receiver.taken)
            with subprocess.Popen(command, env={"PYTHONPATH": path}) as process:
                until = min(before + rng.randint(1, 3), 13)
                wait_for(lambda until=until: len(receiver.taken), lambda now, until=until: now >= until)
                process.kill()
        with subprocess.Popen(command, env={"PYTHONPATH": path}) as process:
            assert process.wait() == 0
    finally:
        receiver.close()
    first_seen = list(dict.fromkeys(receiver.ids()))
    assert first_seen == wanted
