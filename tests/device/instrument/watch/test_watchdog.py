"""When the watchdog is fed, and what screen, log and disk say when it is not. No thread: a test looks itself."""

import socket
from contextlib import ExitStack, closing, suppress

import pytest

from device.instrument.status import StatusBoard
from device.instrument.watch import watchdog as watchdog_module
from device.instrument.watch.progress import Stall
from device.instrument.watch.restart_note import NAME, RestartNote
from device.instrument.watch.watchdog import MOST_RESTARTS, Watchdog

FROZEN = Stall(("light",), 7.62, comes_back=False)
SILENT = Stall(("camera",), 7.62, comes_back=True)


class Progress:
    """Progress as a test says; remembers the time it was asked for."""

    def __init__(self):
        self.now, self.asked_s = None, 0.0

    def stall(self, watchdog_s):
        self.asked_s = watchdog_s
        return self.now


class Rig:
    def __init__(self, folder, restarts=0):
        self.folder, self.progress, self.board = folder, Progress(), StatusBoard()
        note = RestartNote(folder)
        note.times = restarts
        self.watchdog = Watchdog(self.progress, self.board, note)

    def looks_at(self, stall):
        self.progress.now = stall
        self.watchdog.look()


@pytest.fixture
def told(monkeypatch):
    messages = []
    monkeypatch.setattr(watchdog_module, "notify", lambda *assignments: messages.append(assignments))
    return messages


@pytest.fixture
def rig(tmp_path, told, monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", "10000000")
    return Rig(tmp_path)


def test_while_all_parts_go_on_it_is_fed(rig, told):
    rig.looks_at(None)
    rig.looks_at(None)
    assert told == [("WATCHDOG=1", "STATUS=all parts go on")] * 2
    assert rig.progress.asked_s == 10.0


def test_a_frozen_part_is_on_the_screen_in_the_log_and_on_the_disk_and_nothing_is_fed(rig, told, tmp_path, caplog):
    rig.looks_at(FROZEN)
    rig.looks_at(FROZEN)
    assert told == []
    assert rig.board.now.hindrance.code == "E901"
    assert str(rig.board.now.stall) == "The LED chip made no progress for 7.6 s. Wait: the probe restarts."
    assert caplog.text.count("E901") == 1
    assert "the LED chip made no progress for 7.6 s" in RestartNote(tmp_path).warning().cause


def test_a_part_that_goes_on_again_in_time_is_no_fault_any_more(rig, told, tmp_path):
    rig.looks_at(FROZEN)
    rig.looks_at(None)
    assert rig.board.now.hindrance is None
    assert not (tmp_path / NAME).exists()
    assert [message[0] for message in told] == ["WATCHDOG=1"]


@pytest.mark.parametrize(("stall", "is_fed"), [(SILENT, True), (FROZEN, False)])
def test_restarts_that_did_not_help_end_for_a_part_that_still_answers(rig, told, tmp_path, stall, is_fed):
    rig = Rig(tmp_path, restarts=MOST_RESTARTS)
    rig.looks_at(stall)
    assert bool(told) is is_fed
    assert rig.board.now.stall.code == "E901"
    assert (tmp_path / NAME).exists() is not is_fed


def test_one_restart_less_is_still_tried(rig, told, tmp_path):
    Rig(tmp_path, restarts=MOST_RESTARTS - 1).looks_at(SILENT)
    assert told == []


def test_without_systemd_the_fault_is_shown_and_no_restart_is_promised(tmp_path, told, monkeypatch):
    monkeypatch.delenv("WATCHDOG_USEC", raising=False)
    rig = Rig(tmp_path)
    rig.looks_at(FROZEN)
    assert "off and on" in str(rig.board.now.stall)
    assert not (tmp_path / NAME).exists()


def test_a_daemon_says_when_it_is_ready_and_when_it_ends_and_leaves_no_note(rig, told, tmp_path):
    rig.looks_at(FROZEN)
    rig.watchdog.start()
    rig.watchdog.close()
    assert told == [("READY=1",), ("STOPPING=1",)]
    assert not (tmp_path / NAME).exists()


def test_a_systemd_that_is_gone_ends_nothing(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "gone"))
    Rig(tmp_path).looks_at(None)
    assert "systemd cannot be notified" in caplog.text


def test_a_systemd_that_does_not_read_keeps_neither_the_screen_nor_a_stop_waiting(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
    monkeypatch.setattr(watchdog_module, "NOTIFY_TIMEOUT_S", 0.01)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as unread, closing(fill(tmp_path / "notify", unread)):
        rig = Rig(tmp_path)
        rig.looks_at(None)
        assert "systemd cannot be notified: timed out" in caplog.text
        rig.looks_at(FROZEN)
        assert rig.board.now.hindrance.code == "E901"
        rig.watchdog.start()
        rig.watchdog.close()


def fill(path, unread):
    """Bind a socket there and send to it until it takes no more of anybody; return what closes those that sent.

    One sender is stopped by its own buffer where the machine's net.unix.max_dgram_qlen is large, as under systemd.
    """
    unread.bind(str(path))
    senders = ExitStack()
    is_taken = True
    while is_taken:
        sending = senders.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        sending.setblocking(False)
        is_taken = False
        with suppress(BlockingIOError):
            while True:
                sending.sendto(b"WATCHDOG=1", str(path))
                is_taken = True
    return senders
