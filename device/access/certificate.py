"""The server's certificate: the hospital's files, or one of its own that is made at the first start by OpenSSL.

Nobody vouches for its own one: whoever connects compares its SHA-256 with the one on the probe's screen.
"""

from __future__ import annotations

import hashlib
import ipaddress
import os
import re
import ssl
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

from device.access.pem_file import OPENSSL_S
from device.errors import CertificateRefused

FOLDER = "tls"
"""Where it lies in the data folder; a backup leaves it out."""
DAYS = 3650
NOT_BEFORE, NOT_AFTER = datetime(2025, 1, 1, tzinfo=UTC), datetime(2049, 12, 31, tzinfo=UTC)
"""An own one begins at the former whatever the clock says, which may be ahead, and holds `DAYS` from its making or,
where the clock is behind, from there. It ends by the latter: dates of 2050 and later are written otherwise."""
CIPHERS = "ECDHE+AESGCM:ECDHE+CHACHA20"
"""Of TLS 1.2: those with forward secrecy that authenticate what they encrypt. TLS 1.3 has no others."""
TIME = "%Y%m%d%H%M%SZ"
SETTINGS = """[ca]
default_ca = own
[own]
database = index.txt
new_certs_dir = .
rand_serial = yes
default_md = sha256
policy = policy
x509_extensions = server
[policy]
commonName = supplied
[req]
distinguished_name = name
[name]
[server]
basicConstraints = critical,CA:FALSE
keyUsage = critical,digitalSignature
extendedKeyUsage = serverAuth
subjectKeyIdentifier = hash
"""
"""Of `openssl ca`, which is asked to sign a single time: `openssl req` of 3.0 lets a certificate begin now alone."""
UNTIL_THEN = "Until then only the probe's own screen is served."
NAME_OTHERS = "Name another by server.certificate and server.certificate_key, and start the daemon again."
MAKE_ANEW = (
    "Delete the folder tls in the data folder, start the daemon again, and give the new certificate to the machines "
    "that know the old one."
)
NAME = re.compile(r"[a-z0-9]([a-z0-9.-]{0,251}[a-z0-9])?")


@dataclass(frozen=True)
class ServerCertificate:
    """The files of a certificate (chain) and its key, PEM; `renewal` says how another takes its place."""

    certificate: Path
    key: Path
    renewal: str = NAME_OTHERS

    @property
    def sha256(self) -> str:
        """The fingerprint of the server's own certificate, as browsers show it: AB:CD:..."""
        text = self.certificate.read_text(encoding="ascii", errors="replace")
        begin, end = text.find(ssl.PEM_HEADER), text.find(ssl.PEM_FOOTER)
        digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(text[begin : end + len(ssl.PEM_FOOTER)])).hexdigest().upper()
        return ":".join(digest[at : at + 2] for at in range(0, len(digest), 2))

    def require_usable(self) -> None:
        """Raise `CertificateRefused` unless certificate and key can be read and belong together."""
        try:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(self.certificate, self.key, lambda: "")  # nobody is there to type a key's password
            self.sha256  # noqa: B018 - what OpenSSL takes and has no PEM header of its own raises here
        except (OSError, ValueError) as error:
            cause = f"The certificate {self.certificate} with the key {self.key} cannot be used: {error}."
            raise CertificateRefused(cause, f"{self.renewal} {UNTIL_THEN}") from error


def own_certificate(folder: Path, names: Iterable[str]) -> ServerCertificate:
    """Return the probe's own certificate in a folder; make it when there is none, for names and addresses of it.

    Raises `CertificateRefused` when OpenSSL is missing or fails, the disk takes nothing, or what is there cannot be
    used.
    """
    own = ServerCertificate(folder / "certificate.pem", folder / "key.pem", MAKE_ANEW)
    try:
        if not own.certificate.exists():
            _make(own, sorted(set(names)))
    except OSError as error:
        remedy = f"Let the daemon's user write in the data folder, and start the daemon again. {UNTIL_THEN}"
        raise CertificateRefused(f"No certificate could be made in {folder}: {error}.", remedy) from error
    own.require_usable()
    return own


def _make(own: ServerCertificate, names: list[str]) -> None:
    own.key.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    made = ServerCertificate(own.certificate.with_suffix(".tmp"), own.key.with_suffix(".tmp"))
    for path in (made.certificate, made.key):
        path.unlink(missing_ok=True)
    made.key.touch(mode=0o600)
    try:
        with TemporaryDirectory(dir=own.key.parent, suffix=".tmp") as folder:
            _sign(made, names, Path(folder))
    except (OSError, subprocess.SubprocessError) as error:
        why = getattr(error, "stderr", "") or str(error)
        remedy = "Install openssl, or name the hospital's files by server.certificate and server.certificate_key."
        raise CertificateRefused(
            f"No certificate could be made: {why.strip()[-300:]}.", f"{remedy} {UNTIL_THEN}"
        ) from error
    for at, path in ((made.key, own.key), (made.certificate, own.certificate)):  # the certificate is what is looked for
        _synchronise(at)
        os.replace(at, path)
    _synchronise(own.key.parent)


def _sign(made: ServerCertificate, names: list[str], folder: Path) -> None:
    """Make key and certificate by OpenSSL, with its own files in a folder that nobody needs afterwards."""
    (folder / "index.txt").touch()
    alternatives = ",".join(filter(None, map(_alternative, names)))
    settings, request = folder / "openssl.cnf", "request.pem"
    key, certificate = str(made.key.absolute()), str(made.certificate.absolute())
    subject = f"subjectAltName = {alternatives}\n" if alternatives else ""
    settings.write_text(SETTINGS + subject, encoding="ascii")
    begins, ends = (moment.strftime(TIME) for moment in period(datetime.now(UTC)))
    for command in (
        [
            *("openssl", "req", "-new", "-config", settings.name, "-newkey", "ec", "-noenc", "-keyout", key),
            *("-pkeyopt", "ec_paramgen_curve:P-256", "-subj", "/CN=TSIS probe", "-out", request),
        ],
        [
            *("openssl", "ca", "-selfsign", "-batch", "-notext", "-config", settings.name, "-in", request),
            *("-keyfile", key, "-startdate", begins, "-enddate", ends, "-out", certificate),
        ],
    ):
        subprocess.run(command, check=True, capture_output=True, text=True, timeout=OPENSSL_S, cwd=folder)


def period(now: datetime) -> tuple[datetime, datetime]:
    """Return from when until when an own one holds that is made now by the board's clock, which may show any year."""
    return NOT_BEFORE, min(max(now, NOT_BEFORE), NOT_AFTER - timedelta(days=DAYS)) + timedelta(days=DAYS)


def _alternative(name: str) -> str:
    try:
        return f"IP:{ipaddress.ip_address(name)}"
    except ValueError:
        return f"DNS:{name}" if NAME.fullmatch(name) else ""


def _synchronise(path: Path) -> None:
    opened = os.open(path, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
