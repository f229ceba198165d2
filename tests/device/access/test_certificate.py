"""The server's own certificate: made once by OpenSSL for the probe's names, its key for nobody else to read."""

import shutil
import ssl
import stat
import subprocess
from datetime import UTC, datetime, timedelta

import pytest

from device.access.certificate import DAYS, ServerCertificate, own_certificate, period
from device.access.pem_file import held_periods
from device.errors import CertificateRefused

NAMES = ["probe-7", "probe-7.local", "192.0.2.20", "::1", "no name/CN=evil", "a,DNS:evil.example"]


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    return own_certificate(tmp_path_factory.mktemp("data") / "tls", NAMES)


def openssl(*arguments):
    return subprocess.run(["openssl", *arguments], capture_output=True, text=True, check=True).stdout


def test_it_is_for_the_names_of_the_probe_and_for_no_other(own):
    said = openssl("x509", "-in", str(own.certificate), "-noout", "-ext", "subjectAltName,basicConstraints")
    assert sorted(said.split("Alternative Name:")[1].split("X509v3")[0].replace(" ", "").strip().split(",")) == [
        *("DNS:probe-7", "DNS:probe-7.local", "IPAddress:0:0:0:0:0:0:0:1", "IPAddress:192.0.2.20")
    ]
    assert "evil" not in said
    assert "CA:FALSE" in said


def test_it_has_a_key_of_a_curve_and_nobody_else_reads_that(own):
    assert "NIST CURVE: P-256" in openssl("x509", "-in", str(own.certificate), "-noout", "-text")
    assert stat.S_IMODE(own.key.stat().st_mode) == 0o600
    assert stat.S_IMODE(own.key.parent.stat().st_mode) == 0o700
    assert {path.name for path in own.key.parent.iterdir()} == {"certificate.pem", "key.pem"}


@pytest.mark.parametrize(
    ("made_in", "ends_in"), [(1970, 2034), (2024, 2034), (2026, 2035), (2039, 2048), (2040, 2049), (2099, 2049)]
)
def test_it_has_begun_and_holds_for_years_whatever_year_the_clock_shows(made_in, ends_in):
    begins, ends = period(datetime(made_in, 1, 1, tzinfo=UTC))
    assert (begins, ends.year) == (datetime(2025, 1, 1, tzinfo=UTC), ends_in)


def test_its_end_is_ten_years_from_now(own):
    left = datetime.fromtimestamp(held_periods(own.certificate)[0].ends_s, UTC) - datetime.now(UTC)
    assert timedelta(days=DAYS - 1) < left <= timedelta(days=DAYS)


def test_one_made_while_the_clock_was_years_ahead_is_trusted_once_it_is_right(tmp_path, monkeypatch):
    """A client by the right clock verifies it: made by a start with a clock of 2040, it began in 2040 before."""

    class Ahead(datetime):
        @classmethod
        def now(cls, zone=None):
            return datetime(2040, 1, 1, tzinfo=zone)

    monkeypatch.setattr("device.access.certificate.datetime", Ahead)
    own = own_certificate(tmp_path / "tls", ["probe-7"])
    said = openssl("x509", "-in", str(own.certificate), "-noout", "-startdate", "-enddate")
    assert said.splitlines() == ["notBefore=Jan  1 00:00:00 2025 GMT", "notAfter=Dec 29 00:00:00 2049 GMT"]
    pem = str(own.certificate)
    assert openssl("verify", "-x509_strict", "-purpose", "sslserver", "-trusted", pem, pem) == f"{pem}: OK\n"


def test_its_fingerprint_is_the_one_that_openssl_says(own):
    said = openssl("x509", "-in", str(own.certificate), "-noout", "-fingerprint", "-sha256")
    assert said.strip().partition("=")[2] == own.sha256


def test_it_stays_the_same_at_the_next_start_whatever_the_names(own):
    before = own.certificate.read_bytes(), own.key.read_bytes()
    again = own_certificate(own.key.parent, ["another"])
    assert (again.certificate.read_bytes(), again.key.read_bytes()) == before


def test_without_its_folder_the_next_start_makes_one_of_the_present_names(tmp_path):
    before = own_certificate(tmp_path / "tls", ["probe-7"]).sha256
    shutil.rmtree(tmp_path / "tls")
    anew = own_certificate(tmp_path / "tls", ["ward-3"])
    assert anew.sha256 != before
    assert "DNS:ward-3" in openssl("x509", "-in", str(anew.certificate), "-noout", "-ext", "subjectAltName")


def test_of_a_chain_the_fingerprint_is_that_of_the_first(own, tmp_path):
    other = own_certificate(tmp_path / "other", ["ca"])
    chain = tmp_path / "chain.pem"
    chain.write_bytes(own.certificate.read_bytes() + other.certificate.read_bytes())
    assert ServerCertificate(chain, own.key).sha256 == own.sha256


def test_files_that_are_none_or_do_not_belong_together_are_refused(own, tmp_path):
    other = own_certificate(tmp_path / "other", ["x"])
    (tmp_path / "text.pem").write_text("no certificate")
    for certificate, key in (
        (own.certificate, other.key),
        (tmp_path / "text.pem", own.key),
        (tmp_path / "none.pem", own.key),
        (own.certificate, tmp_path / "none.pem"),
    ):
        with pytest.raises(CertificateRefused, match="cannot be used") as refusal:
            ServerCertificate(certificate, key).require_usable()
        assert refusal.value.code == "E021"
        assert "server.certificate" in refusal.value.remedy


def test_a_key_that_asks_for_a_password_is_refused_and_nobody_is_asked(own, tmp_path):
    locked = tmp_path / "locked.pem"
    openssl("pkey", "-in", str(own.key), "-aes256", "-passout", "pass:secret", "-out", str(locked))
    with pytest.raises(CertificateRefused, match="cannot be used"):
        ServerCertificate(own.certificate, locked).require_usable()


def test_an_own_one_that_is_damaged_or_cannot_be_made_says_what_to_do_with_its_folder(tmp_path):
    (tmp_path / "tls").mkdir()
    (tmp_path / "tls" / "certificate.pem").write_text("half")
    with pytest.raises(CertificateRefused) as damaged:
        own_certificate(tmp_path / "tls", ["x"])
    assert "Delete the folder tls" in damaged.value.remedy
    (tmp_path / "file").write_text("")
    with pytest.raises(CertificateRefused, match="could be made in") as unmade:
        own_certificate(tmp_path / "file" / "tls", ["x"])
    assert "Let the daemon's user write in the data folder" in unmade.value.remedy


def test_without_openssl_it_says_what_to_do_and_leaves_nothing_that_looks_whole(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CertificateRefused, match="No certificate could be made") as refusal:
        own_certificate(tmp_path / "tls", ["x"])
    assert "Install openssl" in refusal.value.remedy
    assert not (tmp_path / "tls" / "certificate.pem").exists()


def test_a_key_that_a_power_cut_left_alone_is_made_anew(tmp_path):
    own = own_certificate(tmp_path / "tls", ["x"])
    own.certificate.unlink()
    (tmp_path / "tls" / "certificate.tmp").write_text("half")
    made = own_certificate(tmp_path / "tls", ["x"])
    ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(made.certificate, made.key)
    assert shutil.which("openssl")
