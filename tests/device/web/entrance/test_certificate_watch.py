"""When the end and the beginning of certificates are told, of files by OpenSSL, at times that a test says."""

import logging
import subprocess
import threading
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace

import pytest

from device.access.certificate import ServerCertificate, own_certificate
from device.access.pem_file import held_periods
from device.commands.serve import _certificate_watch
from device.config import Config, DicomSection, ServerSection, WebhookSection
from device.instrument.status import StatusBoard
from device.web.entrance import certificate_watch
from device.web.entrance.certificate_watch import CertificateWatch, watched_files

DAY_S = 86400.0
REMEDY_OWN = "Delete the folder tls in the data folder"


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    return own_certificate(tmp_path_factory.mktemp("data") / "tls", ["probe-7"])


def ends_s(path):
    return held_periods(path)[0].ends_s


def made(path, name, days):
    """Write a certificate that holds so many days from now; return its file."""
    command = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-noenc"]
    files = ["-keyout", str(path.with_suffix(".key")), "-out", str(path)]
    subprocess.run([*command, *files, "-subj", f"/CN={name}", "-days", str(days)], check=True, capture_output=True)
    return path


class Told:
    """What a watch of files tells, at times of the test."""

    def __init__(self, files, *, is_steady=True):
        self.faults, self.now_s = [], 0.0
        self.watch = CertificateWatch(files, self.faults.append, lambda: is_steady, lambda: self.now_s)

    def at(self, now_s):
        self.now_s = now_s
        self.watch.look()
        return self.faults[-1] if self.faults else None


def of_server(certificate):
    return watched_files(Config(), certificate)


def test_the_end_of_a_certificate_is_told_a_month_before_it_and_after_it_by_a_steady_clock(own):
    told, end_s = Told(of_server(own)), ends_s(own.certificate)
    for days in (400, 31, 29.9, 29.8, -1):
        told.at(end_s - days * DAY_S)
    before, after = told.faults
    day, where = datetime.fromtimestamp(end_s, UTC).date(), f"{own.certificate} (server.certificate)"
    assert (before.code, before.severity, after.code) == ("E022", "warning", "E022")
    begun = f"The certificate 'CN=TSIS probe' in {where} "
    assert before.cause == f"{begun}ends on {day}, in 30 days: then other machines refuse the probe."
    assert after.cause == f"{begun}has ended on {day}: other machines refuse the probe."
    assert REMEDY_OWN in after.remedy


def test_one_that_has_not_begun_is_told_until_it_has(own):
    """As an own one of an earlier release that was made while the clock was ahead, once that is right."""
    [begun] = held_periods(own.certificate)
    file = of_server(own)[0]
    told = Told([file])
    told.watch._read = {file.setting: (None, (certificate_watch.HeldPeriod("CN=x", begun.ends_s - DAY_S, 9e9),))}
    fault = told.at(begun.ends_s - 60 * DAY_S)
    day, today = (datetime.fromtimestamp(begun.ends_s - days * DAY_S, UTC).date() for days in (1, 60))
    assert fault.code == "E022"
    assert f"is not valid before {day}, and the clock shows {today}: other machines refuse the probe." in fault.cause
    assert REMEDY_OWN in fault.remedy
    assert told.at(begun.ends_s) is None


def test_nothing_is_told_by_a_clock_that_was_just_set_or_shows_1970(own):
    assert Told(of_server(own), is_steady=False).at(ends_s(own.certificate)) is None
    assert Told(of_server(own)).at(0.0) is None


def test_a_clock_that_is_put_right_takes_the_warning_back(own):
    told, end_s = Told(of_server(own)), ends_s(own.certificate)
    assert told.at(end_s + DAY_S).code == "E022"
    assert told.at(end_s - 400 * DAY_S) is None


def test_a_hospitals_certificate_is_renewed_by_its_settings(own):
    fault = Told(of_server(ServerCertificate(own.certificate, own.key))).at(ends_s(own.certificate))
    assert "server.certificate and server.certificate_key" in fault.remedy


def test_every_certificate_of_every_setting_is_watched_and_a_renewed_file_is_read_again(own, tmp_path):
    authority = tmp_path / "ca.pem"
    old, new = made(tmp_path / "old.pem", "old-ca", 40), made(tmp_path / "new.pem", "new-ca", 900)
    authority.write_bytes(new.read_bytes() + old.read_bytes())
    dicom = DicomSection(tls_authority=authority, tls_certificate=new, tls_key=new.with_suffix(".key"))
    stated = ServerSection(client_authority=str(new))
    config = Config(server=stated, dicom=dicom, webhook=WebhookSection(tls_authority=new))
    files = watched_files(config, own)
    assert [file.setting for file in files] == [
        *("server.certificate", "server.client_authority"),
        *("dicom.tls_authority", "dicom.tls_certificate", "webhook.tls_authority"),
    ]
    told, end_s = Told(files), ends_s(old)
    fault = told.at(end_s - 10 * DAY_S)
    day = datetime.fromtimestamp(end_s, UTC).date()
    assert fault.cause == (
        f"The certificate 'CN=old-ca' in {authority} (dicom.tls_authority) ends on {day}, in 10 days: "
        "then the archive it vouches for is refused."
    )
    assert told.watch.ends_s()["dicom.tls_authority"] == end_s
    authority.write_bytes(new.read_bytes())
    assert told.at(end_s - 10 * DAY_S) is None
    assert told.watch.ends_s()["dicom.tls_authority"] == ends_s(new)


def test_what_other_machines_see_is_the_file_of_the_start_until_the_next_one(tmp_path):
    path = made(tmp_path / "probe.pem", "probe", 40)
    told, end_s = Told(of_server(ServerCertificate(path, path.with_suffix(".key")))), ends_s(path)
    assert told.at(end_s).code == "E022"
    made(path, "probe", 900)
    assert told.at(end_s).code == "E022"


def test_one_that_the_daemon_may_read_since_is_watched(own, monkeypatch):
    """Its owner or mode is changed, which changes neither its content nor when that was written."""
    may_read = []
    monkeypatch.setattr(certificate_watch, "held_periods", lambda path: held_periods(path) if may_read else ())
    told = Told(watched_files(Config(dicom=DicomSection(tls_authority=own.certificate)), None))
    assert told.at(4e9) is None
    may_read.append(own.certificate)
    own.certificate.chmod(own.certificate.stat().st_mode)
    assert told.at(4e9).code == "E022"


def test_where_nobody_can_say_when_it_ends_nothing_is_told(own, tmp_path, monkeypatch, caplog):
    (tmp_path / "text.pem").write_text("no certificate")
    with caplog.at_level(logging.WARNING):
        assert held_periods(tmp_path / "text.pem") == held_periods(tmp_path / "none.pem") == ()
        monkeypatch.setenv("PATH", str(tmp_path))
        told = Told(of_server(own))
        assert told.at(4e9) is None
    assert caplog.text.count("cannot be read") == 3
    assert told.watch.ends_s() == {}


def test_the_daemon_tells_it_in_its_status_and_ends_the_watch(own, monkeypatch):
    """By the watch's own thread: nobody else looks."""
    board, is_told = StatusBoard(), threading.Event()
    update = board.update
    monkeypatch.setattr(board, "update", lambda **changes: (update(**changes), is_told.set()))
    monkeypatch.setattr(certificate_watch, "LOOK_S", 0.001)
    procedure = SimpleNamespace(board=board, is_clock_steady=True, config=Config())
    watch = _certificate_watch(SimpleNamespace(certificate=own), procedure)
    end_s = ends_s(own.certificate)
    watch._wall_time_s = lambda: end_s + 1.0
    watch.start()
    assert is_told.wait(60.0)
    assert board.now.certificate.code == "E022"
    watch.close()
    assert not watch._thread.is_alive()


def test_a_probe_without_certificates_watches_none():
    assert watched_files(Config(data=Path("var")), None) == []
