"""Where TLS with the archive fails, the operator reads that, IT reads why, and both what to do."""

import re
import socket
import ssl
import struct
import threading
from contextlib import contextmanager, suppress

import pytest
from daemon_process import wait_for
from pynetdicom import AE
from signed_certificates import Authority
from written_exam import begin, measure

from device.config import DicomSection
from device.dicom.association import COMMITMENT, VERIFICATION, archive_of, echo
from device.dicom.hospital import Hospital
from device.errors import ArchiveUnreachable, ArchiveUntrusted
from device.files.recording_file import read_picture
from device.sending import tls_failure

UNCLOSED = pytest.mark.filterwarnings("ignore:.*<(socket.socket|ssl.SSLSocket):pytest.PytestUnraisableExceptionWarning")
pytestmark = UNCLOSED


@pytest.fixture(scope="module")
def hospital_authority(tmp_path_factory):
    return Authority(tmp_path_factory.mktemp("tls") / "hospital", "hospital")


@pytest.fixture(scope="module")
def stranger(tmp_path_factory):
    return Authority(tmp_path_factory.mktemp("tls") / "stranger", "stranger")


@pytest.fixture(scope="module")
def certificates(hospital_authority, stranger):
    return {
        "good": hospital_authority.sign("good"),
        "expired": hospital_authority.sign("expired", from_days=-30, days=10),
        "future": hospital_authority.sign("future", from_days=10, days=10),
        "other address": hospital_authority.sign("other-address", "IP:192.0.2.7"),
        "other name": hospital_authority.sign("other-name", "DNS:pacs.example"),
        "strange": stranger.sign("strange"),
    }


def context(pair, trusted=None, newest=None):
    made = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    made.load_cert_chain(*pair)
    if trusted:
        made.verify_mode = ssl.CERT_REQUIRED
        made.load_verify_locations(trusted)
    if newest:
        made.maximum_version = newest
    return made


@contextmanager
def archive(tls):
    program = AE(ae_title="ARCHIVE")
    program.add_supported_context(VERIFICATION)
    server = program.start_server(("127.0.0.1", 0), block=False, ssl_context=tls)
    try:
        yield server.socket.getsockname()[1]
    finally:
        server.shutdown()


def settings(port, authority, own=None):
    certificate, key = own or (None, None)
    tls = {"tls_authority": authority.certificate, "tls_certificate": certificate, "tls_key": key}
    return DicomSection(archive_host="127.0.0.1", archive_port=port, **tls)


def fault_of(stated):
    with pytest.raises(ArchiveUnreachable) as raised:
        echo(archive_of(stated), stated)
    return raised.value


@pytest.mark.parametrize(
    ("shown", "cause", "remedy"),
    [
        ("strange", r"that this probe does not trust \(unable to get local issuer", "dicom.tls_authority"),
        ("expired", r"has expired by this probe's clock, 20\d\d-\d\d-\d\d \d\d:\d\d UTC", "Check the probe's clock"),
        ("future", r"is not valid yet by this probe's clock, 20\d\d-", "Check the probe's clock"),
        ("other address", r"for another name \(IP address mismatch.*'127\.0\.0\.1'\)", "dicom.archive_host"),
        ("other name", r"for another name \(IP address mismatch.*'127\.0\.0\.1'\)", "dicom.archive_host"),
    ],
)  # fmt: skip
def test_why_tls_fails_is_told_with_what_to_do(hospital_authority, certificates, shown, cause, remedy):
    with archive(context(certificates[shown])) as port:
        fault = fault_of(settings(port, hospital_authority))
    assert (type(fault), fault.code) == (ArchiveUntrusted, "E818")
    assert fault.cause.startswith(f"The archive ARCHIVE at 127.0.0.1:{port} has a certificate")
    assert re.search(cause, fault.cause)
    assert remedy in fault.remedy


@pytest.mark.parametrize("newest", [ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3], ids=["1.2", "1.3"])
@pytest.mark.parametrize("own", [None, "strange", "expired"], ids=["without", "strange", "expired"])
def test_an_archive_that_does_not_take_the_probes_certificate_is_told(hospital_authority, certificates, newest, own):
    server = context(certificates["good"], trusted=hospital_authority.certificate, newest=newest)
    with archive(server) as port:
        fault = fault_of(settings(port, hospital_authority, own=certificates[own] if own else None))
    assert fault.code == "E818"
    assert "this probe's certificate" in fault.cause
    assert "Set dicom.tls_certificate and tls_key" in fault.remedy


def test_an_archive_that_speaks_in_the_clear_is_told(hospital_authority):
    with archive(None) as port:
        fault = fault_of(settings(port, hospital_authority))
    assert fault.code == "E818"
    assert "does not speak TLS at this port" in fault.cause
    assert "dicom.archive_port" in fault.remedy
    assert "in the clear" not in fault.remedy


def test_a_program_that_is_silent_at_the_handshake_says_nothing_of_tls(monkeypatch):
    monkeypatch.setattr(tls_failure, "LOOK_S", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        assert tls_failure.tls_failure(ssl.create_default_context(), *silent.getsockname()) is None


def test_a_link_that_is_reset_in_the_handshake_says_nothing_of_tls():
    with socket.create_server(("127.0.0.1", 0)) as other:

        def reset():
            connection, _ = other.accept()
            connection.recv(1)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            connection.close()

        thread = threading.Thread(target=reset)
        thread.start()
        made = tls_failure.tls_failure(ssl.create_default_context(), *other.getsockname())
        thread.join()
    assert made is None


@pytest.mark.parametrize(
    "said", [b"HTTP/1.1 400 Bad Request\r\n\r\n", b"\x07\x00\x00\x00\x00\x04\x00\x00\x02\x01", b""]
)
def test_what_answers_something_else_does_not_speak_tls(said):
    with socket.create_server(("127.0.0.1", 0)) as other:

        def answer():
            connection, _ = other.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(said)
                connection.shutdown(socket.SHUT_WR)
                with suppress(ConnectionResetError):
                    while connection.recv(4096):  # closed with something unread it would be reset
                        pass

        thread = threading.Thread(target=answer)
        thread.start()
        made = tls_failure.tls_failure(ssl.create_default_context(), *other.getsockname())
        thread.join()
    assert made.problem == "no_tls"


@pytest.mark.parametrize("kind", [ssl.SSLEOFError, ssl.SSLZeroReturnError])
def test_a_connection_that_ends_in_the_handshake_is_no_tls_whatever_python_calls_it(kind):
    ended = kind(6, "TLS/SSL connection has been closed (EOF)")
    ended.reason = None  # which ssl itself sets
    assert tls_failure._of_handshake(ended).problem == "no_tls"


def test_an_archive_that_is_down_or_refuses_the_title_is_no_matter_of_trust(hospital_authority, certificates):
    with archive(context(certificates["good"])) as port:
        stated = settings(port, hospital_authority)
        echo(archive_of(stated), stated)
    fault = fault_of(stated)
    assert (fault.code, "cannot be reached" in fault.cause) == ("E030", True)


def test_an_archive_whose_certificate_is_good_and_that_takes_nothing_is_no_matter_of_trust(
    hospital_authority, certificates, monkeypatch
):
    monkeypatch.setattr(tls_failure, "ALERT_S", 0.2)
    program = AE(ae_title="ARCHIVE")
    program.add_supported_context(COMMITMENT)
    server = program.start_server(("127.0.0.1", 0), block=False, ssl_context=context(certificates["good"]))
    try:
        fault = fault_of(settings(server.socket.getsockname()[1], hospital_authority))
    finally:
        server.shutdown()
    assert (fault.code, "takes none of what this probe offers" in fault.cause) == ("E030", True)


def test_a_certificate_of_the_settings_that_cannot_be_read_is_one_of_trust(hospital_authority, certificates, tmp_path):
    stated = settings(104, hospital_authority, own=(certificates["good"][0], certificates["strange"][1]))
    fault = fault_of(stated)
    assert fault.code == "E818"
    assert "a certificate of the settings cannot be read" in fault.cause


def test_it_is_on_the_status_until_the_archive_is_trusted(store, hospital_authority, certificates):
    exam = begin(store)
    measure(store, exam)
    told = []
    with archive(context(certificates["expired"])) as port:
        hospital = Hospital(settings(port, hospital_authority), store, read_picture, told.append)
        hospital.send(exam["id"], version=1, by="Ada")
        hospital.start()
        try:
            fault = wait_for(lambda: [one for one in told if one], bool)[0]
        finally:
            hospital.close()
    assert (fault.code, fault.severity) == ("E818", "warning")
    assert hospital.as_record()["fault"]["code"] == "E818"
    assert store.outbox.counts() == {"queued": 2}
