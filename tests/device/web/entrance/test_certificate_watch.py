"""When the end of the server's certificate is told, at times that a test says."""

import logging
import threading
from datetime import UTC, datetime
from types import SimpleNamespace

import pytest

from device.access.certificate import ServerCertificate, ending, own_certificate
from device.commands.serve import _certificate_watch
from device.instrument.status import StatusBoard
from device.web.entrance import certificate_watch
from device.web.entrance.certificate_watch import CertificateWatch

DAY_S = 86400.0


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    return own_certificate(tmp_path_factory.mktemp("data") / "tls", ["probe-7"])


def told_at(certificate, *days_before_end, is_steady=True):
    """Return what is told by looks so many days before the end: a code each, None where it is taken back."""
    told, now_s = [], [0.0]
    watch = CertificateWatch(certificate, told.append, lambda: is_steady, lambda: now_s[0])
    for days in days_before_end:
        now_s[0] = certificate.ends_s() - days * DAY_S
        watch.look()
    return told


def test_the_end_of_a_certificate_is_told_a_month_before_it_and_after_it_by_a_steady_clock(own):
    before, after = told_at(own, 400, 31, 29.9, 29.8, -1)
    day = datetime.fromtimestamp(own.ends_s(), UTC).date()
    assert (before.code, before.severity, after.code) == ("E022", "warning", "E022")
    assert before.cause == f"The server's certificate ends on {day}, in 30 days: other machines then refuse the probe."
    assert after.cause == f"The server's certificate has ended on {day}: other machines then refuse the probe."
    assert "Delete the folder tls in the data folder" in after.remedy


def test_nothing_is_told_by_a_clock_that_was_just_set_or_shows_1970(own):
    assert told_at(own, 10, -1, is_steady=False) == []
    assert told_at(own, own.ends_s() / DAY_S) == []


def test_a_clock_that_is_put_right_takes_the_warning_back(own):
    assert [fault and fault.code for fault in told_at(own, -1, 400)] == ["E022", None]


def test_a_hospitals_certificate_is_renewed_by_its_settings(own):
    given = ServerCertificate(own.certificate, own.key)
    fault = ending(given, given.ends_s(), given.ends_s())
    assert "server.certificate and server.certificate_key" in fault.remedy


def test_where_nobody_can_say_when_it_ends_nothing_is_told(own, tmp_path, monkeypatch, caplog):
    monkeypatch.setenv("PATH", str(tmp_path))
    with caplog.at_level(logging.WARNING):
        watch = CertificateWatch(own, pytest.fail, lambda: True)
    assert "cannot be read" in caplog.text
    watch.start()
    watch.look()
    watch.close()


def test_the_daemon_tells_it_in_its_status_and_ends_the_watch(own, monkeypatch):
    """By the watch's own thread: nobody else looks."""
    board, is_told = StatusBoard(), threading.Event()
    update = board.update
    monkeypatch.setattr(board, "update", lambda **changes: (update(**changes), is_told.set()))
    monkeypatch.setattr(certificate_watch, "LOOK_S", 0.001)
    procedure = SimpleNamespace(board=board, is_clock_steady=True)
    watch = _certificate_watch(SimpleNamespace(certificate=own), procedure)
    watch._wall_time_s = lambda: own.ends_s() + 1.0
    watch.start()
    assert is_told.wait(60.0)
    assert board.now.certificate.code == "E022"
    watch.close()
    assert not watch._thread.is_alive()
