"""With an authority every association is TLS with certificates of both sides, storage commitment included."""

import gc
import socket
import subprocess

import pytest
from orthanc import OWN_TITLE, Orthanc, needs_orthanc
from written_exam import begin, measure

from device.config import DicomSection
from device.dicom import confirmation
from device.dicom.association import archive_of, echo
from device.dicom.hospital import Hospital
from device.errors import ArchiveUnreachable, ArchiveUntrusted
from device.files.recording_file import read_picture
from device.files.toml_record import InvalidRecord, from_table
from device.records.store import Store

UNCLOSED = pytest.mark.filterwarnings("ignore:.*<(socket.socket|ssl.SSLSocket):pytest.PytestUnraisableExceptionWarning")
pytestmark = [needs_orthanc, UNCLOSED]


@pytest.fixture(autouse=True)
def _no_socket_is_left_to_another_test():
    yield
    gc.collect()  # pynetdicom leaves the socket of a refused connection in a cycle


def certificate(folder, name):
    """A certificate for 127.0.0.1 that signs itself, and its key."""
    made = folder / f"{name}.pem", folder / f"{name}.key"
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={name}",
               "-addext", "subjectAltName=IP:127.0.0.1", "-out", made[0], "-keyout", made[1]]  # fmt: skip
    subprocess.run(command, check=True, capture_output=True)
    return made


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("certificates")
    return {name: certificate(folder, name) for name in ("archive", "probe", "stranger")}


@pytest.fixture(scope="module")
def archive(tmp_path_factory, files):
    (certificate_file, key), (probe, _) = files["archive"], files["probe"]
    made = Orthanc(
        tmp_path_factory.mktemp("archive"),
        DicomTlsEnabled=True,
        DicomTlsCertificate=str(certificate_file),
        DicomTlsPrivateKey=str(key),
        DicomTlsTrustedCertificates=str(probe),
        DicomTlsRemoteCertificateRequired=True,
    )
    modality = {"AET": OWN_TITLE, "Host": "127.0.0.1", "Port": made.commitment_port, "UseDicomTls": True}
    made.state(DicomModalities={"probe": modality})
    yield made.start()
    made.close()


def encrypted(archive, files, *, trusted="archive", own="probe", **more):
    own_certificate, own_key = files[own] if own else (None, None)
    return archive.settings(tls_authority=files[trusted][0], tls_certificate=own_certificate, tls_key=own_key, **more)


def queued(settings, store, exam):
    Hospital(settings, store, read_picture).send(exam["id"], version=1, by="Ada")
    return store.outbox.of_exam(exam["id"])


def test_an_exam_is_sent_and_committed_to_by_tls(tmp_path, archive, files):
    settings = encrypted(archive, files, commitment_port=archive.commitment_port)
    store = Store(tmp_path / "var")
    exam = begin(store)
    measure(store, exam)
    hospital = Hospital(settings, store, read_picture)
    hospital.send(exam["id"], version=1, by="Ada")
    assert hospital._delivery().turn() is False
    assert store.outbox.counts() == {"confirmed": 2}
    store.close()


def test_who_connects_to_the_port_of_reports_and_is_silent_stops_no_report(tmp_path, archive, files, monkeypatch):
    monkeypatch.setattr(confirmation, "CONNECT_S", 0.5)
    settings = encrypted(archive, files, commitment_port=archive.commitment_port)
    store = Store(tmp_path / "var")
    exam = begin(store)
    measure(store, exam)
    for row in queued(settings, store, exam):
        store.outbox.note_try(row["uid"])
        store.outbox.settle(row["uid"], "sent")
        store.outbox.begin_transaction("2.25.1", [row["uid"]])
    delivery = Hospital(settings, store, read_picture)._delivery()
    assert delivery._listen() is None
    with socket.create_connection(("127.0.0.1", archive.commitment_port)):
        assert delivery.turn() is True, "the archive has none of it"
        assert store.outbox.counts() == {"queued": 2}
    assert delivery.turn() is False
    assert store.outbox.counts() == {"confirmed": 2}
    store.close()


@pytest.mark.parametrize(
    ("trusted", "own"), [("stranger", "probe"), ("archive", "stranger"), ("archive", None)],
    ids=["archive not trusted", "probe not trusted", "probe without certificate"],
)  # fmt: skip
def test_a_certificate_that_one_side_does_not_trust_ends_it(archive, files, trusted, own):
    settings = encrypted(archive, files, trusted=trusted, own=own)
    with pytest.raises(ArchiveUntrusted, match="certificate"):
        echo(archive_of(settings), settings)


def test_what_is_in_the_clear_is_not_taken(archive):
    with pytest.raises(ArchiveUnreachable):
        echo(archive_of(archive.settings()), archive.settings())


def test_a_certificate_that_cannot_be_read_is_told_and_nothing_sent_in_the_clear(archive, tmp_path):
    settings = archive.settings(tls_authority=tmp_path / "none.pem")
    with pytest.raises(ArchiveUnreachable, match="certificate of the settings cannot be read"):
        echo(archive_of(settings), settings)


@pytest.mark.parametrize(
    "said", [{"tls_key": "k"}, {"tls_certificate": "c"}, {"tls_certificate": "c", "tls_key": "k"},
             {"tls_authority": "a", "commitment_port": 4000}],
)  # fmt: skip
def test_settings_of_tls_that_lack_something_are_refused(said):
    with pytest.raises(InvalidRecord, match=r"dicom\.tls_"):
        from_table(DicomSection, {"archive_host": "x", **said})
