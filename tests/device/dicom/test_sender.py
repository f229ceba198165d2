"""The outbox gets to the archive whatever is killed on the way: nothing is lost, and nothing is there twice."""

import random
import socket
import sqlite3
import subprocess
import sys
import threading
from contextlib import closing

import pytest
from daemon_process import ROOT, wait_for
from hurried_sender import hurry
from orthanc import OWN_TITLE, TITLE, Orthanc, needs_orthanc
from written_exam import begin, measure

from device.dicom.hospital import Hospital
from device.errors import NotSetUp
from device.files.recording_file import read_picture
from device.records.store import Store
from device.sending import persistent_sender

UNCLOSED = pytest.mark.filterwarnings("ignore:.*<socket.socket:pytest.PytestUnraisableExceptionWarning")
pytestmark = [needs_orthanc, UNCLOSED]
MEASUREMENTS = 12


@pytest.fixture
def archive(tmp_path):
    made = Orthanc(tmp_path)
    yield made
    made.close()


def queued(store, archive, measurements=MEASUREMENTS):
    """Queue an exam; return its hospital, which was not started."""
    exam = begin(store)
    for _ in range(measurements):
        measure(store, exam)
    told = []
    hospital = Hospital(archive.settings(), store, read_picture, told.append)
    hospital.send(exam["id"], version=1, by="Ada")
    return hospital, told


def test_an_archive_that_is_down_is_told_of_and_gets_all_once_it_is_there(store, archive, monkeypatch):
    monkeypatch.setattr(persistent_sender, "FIRST_WAIT_S", 0.1)
    hospital, told = queued(store, archive, measurements=2)
    hospital.start()
    try:
        fault = wait_for(lambda: [one for one in told if one], bool)[0]
        assert fault.code == "E030"
        assert hospital.as_record()["fault"]["code"] == "E030"
        wait_for(lambda: hospital.as_record()["next_try_at"], bool)
        assert store.outbox.counts() == {"queued": 4}
        archive.start()
        wait_for(store.outbox.counts, lambda counts: counts == {"confirmed": 4})
        wait_for(lambda: told[-1], lambda last: last is None)
        assert hospital.as_record()["fault"] is None
        assert len(archive.ask("instances")) == 4
    finally:
        hospital.close()


def test_an_archive_that_is_down_for_two_hours_is_tried_by_the_schedule_and_gets_all(store, archive):
    """The hours are the sender's own: what it waits is added up, and takes no time."""
    hospital, told = queued(store, archive, measurements=2)
    uids = {row["uid"] for row in store.outbox.in_state("queued", limit=99)}
    waiting = hurry(hospital._sender)
    hospital.start()
    try:
        wait_for(lambda: sum(waiting.waited_s), lambda seconds: seconds >= 2 * 3600.0)
        assert waiting.waited_s[:9] == [2, 4, 8, 16, 32, 64, 128, 256, 300]
        assert max(waiting.waited_s) == persistent_sender.LONGEST_WAIT_S
        assert store.outbox.counts() == {"queued": 4}
        assert told[-1].code == "E030"
        archive.start()
        wait_for(store.outbox.counts, lambda counts: counts == {"confirmed": 4})
    finally:
        hospital.close()
    assert sorted(one["SOPInstanceUID"] for one in archive.kept()) == sorted(uids)


def test_what_the_archive_refuses_is_told_of_until_it_is_sent_again(store, archive, monkeypatch):
    hospital, told = queued(store, archive.start(), measurements=1)
    [exam] = {row["exam_id"] for row in store.outbox.in_state("queued", limit=9)}
    path = store.recording_path("r-1")
    path.rename(path.with_suffix(".away"))
    hospital.start()
    try:
        fault = wait_for(lambda: [one for one in told if one], bool)[0]
        assert fault.code == "E031"
        assert "Objects that were refused: 1;" in fault.cause
        path.with_suffix(".away").rename(path)
        hospital.send(exam, version=1, by="Ada")
        wait_for(store.outbox.counts, lambda counts: counts == {"confirmed": 2})
        wait_for(lambda: told[-1], lambda last: last is None)
    finally:
        hospital.close()


def test_nothing_is_sent_while_the_probe_is_busy_and_all_after_that(store, archive, monkeypatch):
    monkeypatch.setattr(persistent_sender, "BUSY_LOOK_S", 0.02)
    exam, looks, is_free = begin(store), [], []
    measure(store, exam)
    told = []
    hospital = Hospital(
        archive.start().settings(), store, read_picture, told.append, lambda: looks.append(1) or not is_free
    )
    hospital.send(exam["id"], version=1, by="Ada")
    hospital.start()
    try:
        wait_for(lambda: len(looks), lambda number: number >= 3)
        assert store.outbox.counts() == {"queued": 2}
        is_free.append(1)
        wait_for(store.outbox.counts, lambda counts: counts == {"confirmed": 2})
    finally:
        hospital.close()


def test_a_stop_waits_for_no_archive_that_is_silent(store, archive):
    others = threading.enumerate()
    with socket.create_server(("127.0.0.1", 0)) as silent:
        exam = begin(store)
        measure(store, exam)
        settings = archive.settings(archive_port=silent.getsockname()[1])
        hospital = Hospital(settings, store, read_picture)
        hospital.send(exam["id"], version=1, by="Ada")
        hospital.start()
        accepted, _ = silent.accept()

        def of_dicom():
            return [thread for thread in threading.enumerate() if "UnawaitedProvider" in type(thread).__name__]

        providers = wait_for(of_dicom, bool)
        assert all(thread.daemon for thread in threading.enumerate() if thread not in others)
        accepted.close()
        wait_for(lambda: [one for one in providers if one.is_alive()], lambda alive: not alive)
        hospital.close()
    assert store.outbox.counts() == {"queued": 2}


def test_what_an_archive_answers_can_not_end_the_thread(store, archive, monkeypatch):
    monkeypatch.setattr(persistent_sender, "FIRST_WAIT_S", 0.05)
    hospital, told = queued(store, archive, measurements=1)

    class Broken:
        turns = 0

        def turn(self, is_stopping):
            Broken.turns += 1
            raise KeyError("patient's name")

        def close(self):
            Broken.turns = -1

    hospital._sender._deliver = Broken
    hospital.start()
    wait_for(lambda: Broken.turns, lambda turns: turns >= 3)
    hospital.close()
    assert Broken.turns == -1
    assert "patient" not in str(told[-1])
    assert store.outbox.counts() == {"queued": 2}


def test_nothing_is_sent_where_no_archive_is_set(store, archive):
    exam = begin(store)
    measure(store, exam)
    hospital = Hospital(archive.settings(archive_host=None), store, read_picture)
    with pytest.raises(NotSetUp, match="No archive is set"):
        hospital.send(exam["id"], version=1, by="Ada")
    assert store.outbox.counts() == {}


def settled(folder):
    """How many objects the archive has answered for, as another process sees it."""
    with closing(sqlite3.connect(f"file:{folder}/tsis.sqlite?mode=ro", uri=True)) as db:
        return db.execute("SELECT count(*) FROM outbox WHERE state != 'queued'").fetchone()[0]


@pytest.mark.long
def test_kills_of_sender_and_archive_lose_nothing_and_double_nothing(store, archive):
    queued(store, archive)
    uids = {row["uid"] for row in store.outbox.in_state("queued", limit=999)}
    store.close()
    rng, kills = random.Random(1), 0
    archive.start()
    command = [sys.executable, "-m", "sending_process", str(store.folder), str(archive.port), OWN_TITLE, TITLE]
    path = f"{ROOT}:{ROOT / 'tests'}"
    while (before := settled(store.folder)) < 2 * MEASUREMENTS:
        with subprocess.Popen(command, env={"PYTHONPATH": path}) as process:
            until = min(before + rng.randint(1, 4), 2 * MEASUREMENTS)
            wait_for(lambda until=until: settled(store.folder), lambda now, until=until: now >= until)
            if rng.random() < 0.3:
                archive.kill()
                archive.start()
            process.kill()
            kills += 1
    assert kills >= 5
    with subprocess.Popen(command, env={"PYTHONPATH": path}) as process:
        assert process.wait() == 0
    again = Store(store.folder)
    assert {row["uid"] for row in again.outbox.in_state("confirmed", limit=999)} == uids
    again.close()
    assert sorted(one["SOPInstanceUID"] for one in archive.kept()) == sorted(uids)
