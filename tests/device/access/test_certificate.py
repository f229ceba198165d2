"""The server's own certificate: made once by OpenSSL for the probe's names, its key for nobody else to read."""

import shutil
import ssl
import stat
import subprocess
from datetime import UTC, datetime, timedelta

import pytest

from device.access.certificate import ServerCertificate, days_from, own_certificate
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


@pytest.mark.parametrize("year", [1970, 2024, 2026, 2099])
def test_it_holds_for_ten_years_also_where_the_clock_shows_1970(year):
    made_at = datetime(year, 1, 1, tzinfo=UTC)
    assert made_at + timedelta(days=days_from(made_at)) >= datetime(2034, 12, 30, tzinfo=UTC)
    assert days_from(made_at) == 3650 or year < 2025


def test_its_end_is_ten_years_from_now(own):
    left = datetime.fromtimestamp(own.ends_s(), UTC) - datetime.now(UTC)
    assert timedelta(days=days_from(datetime.now(UTC)) - 1) < left <= timedelta(days=days_from(datetime.now(UTC)))


def test_an_end_that_cannot_be_read_is_none(own, tmp_path):
    (tmp_path / "text.pem").write_text("no certificate")
    assert ServerCertificate(tmp_path / "text.pem", own.key).ends_s() is None
    assert ServerCertificate(tmp_path / "none.pem", own.key).ends_s() is None


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
