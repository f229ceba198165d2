"""Datagrams to a socket as systemd binds it, by path or in the abstract name space."""

import os
import socket

import pytest

from device.instrument.watch.watchdog import notify, watchdog_s


@pytest.fixture
def listening():
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as bound:
        bound.settimeout(5.0)
        yield bound


def test_assignments_are_lines_of_one_datagram(listening, tmp_path, monkeypatch):
    listening.bind(str(tmp_path / "notify"))
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
    assert notify("READY=1", "STATUS=all is well")
    assert listening.recv(100) == b"READY=1\nSTATUS=all is well"


def test_an_address_that_begins_with_an_at_sign_is_an_abstract_one(listening, monkeypatch):
    name = f"tsis-test-{os.getpid()}"
    listening.bind(f"\0{name}")
    monkeypatch.setenv("NOTIFY_SOCKET", f"@{name}")
    assert notify("WATCHDOG=1")
    assert listening.recv(100) == b"WATCHDOG=1"


def test_without_systemd_nothing_is_sent(monkeypatch):
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    assert not notify("READY=1")


def test_a_socket_that_is_gone_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "gone"))
    with pytest.raises(FileNotFoundError):
        notify("READY=1")


@pytest.mark.parametrize(
    ("asked_us", "pid", "time_s"),
    [
        ("15000000", None, 15.0),
        ("15000000", "own", 15.0),
        ("15000000", "1", None),
        (None, None, None),
        ("", "", None),
    ],
)
def test_the_watchdogs_time_is_that_of_this_process(monkeypatch, asked_us, pid, time_s):
    for name, value in (("WATCHDOG_USEC", asked_us), ("WATCHDOG_PID", str(os.getpid()) if pid == "own" else pid)):
        if value is None:
            monkeypatch.delenv(name, raising=False)
        else:
            monkeypatch.setenv(name, value)
    assert watchdog_s() == time_s
