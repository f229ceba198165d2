"""The server's certificate: the hospital's files, or one of its own that is made at the first start by OpenSSL.

Nobody vouches for its own one: whoever connects compares its SHA-256 with the one on the probe's screen.
"""

from __future__ import annotations

import hashlib
import ipaddress
import logging
import os
import re
import ssl
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from device.errors import CertificateEnds, CertificateRefused

log = logging.getLogger(__name__)
FOLDER = "tls"
"""Where it lies in the data folder; a backup leaves it out."""
DAYS = 3650
NOT_BEFORE = datetime(2025, 1, 1, tzinfo=UTC)
"""Older than this software: a clock that shows less is wrong, and the certificate holds `DAYS` from here on."""
OPENSSL_S = 60.0
CIPHERS = "ECDHE+AESGCM:ECDHE+CHACHA20"
"""Of TLS 1.2: those with forward secrecy that authenticate what they encrypt. TLS 1.3 has no others."""
EXTENSIONS = (
    "basicConstraints=critical,CA:FALSE",
    "keyUsage=critical,digitalSignature",
    "extendedKeyUsage=serverAuth",
)
SOON_DAYS, DAY_S = 30, 86400
"""So many days before its end a certificate is told of."""
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

    def ends_s(self) -> float | None:
        """Return until when the server's own certificate holds, in seconds since 1970; None when nobody can say."""
        command = ["openssl", "x509", "-enddate", "-noout", "-in", str(self.certificate)]
        try:
            said = subprocess.run(
                command,
                check=True,
                capture_output=True,
                text=True,
                timeout=OPENSSL_S,
            ).stdout
            return float(ssl.cert_time_to_seconds(said.strip().partition("=")[2]))  # its months are English anywhere
        except (OSError, ValueError, subprocess.SubprocessError) as error:
            log.warning("When the certificate %s ends cannot be read: %s", self.certificate, error)
            return None

    def require_usable(self) -> None:
        """Raise `CertificateRefused` unless certificate and key can be read and belong together."""
        try:
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.certificate, self.key)
        except (OSError, ssl.SSLError) as error:
            cause = f"The certificate {self.certificate} with the key {self.key} cannot be used: {error}."
            raise CertificateRefused(cause, "Correct server.certificate and server.certificate_key.") from error


def ending(certificate: ServerCertificate, ends_s: float, now_s: float) -> CertificateEnds | None:
    """Return the warning of a certificate that ends soon or has ended, None before. Both times in s since 1970."""
    days_left = (ends_s - now_s) / DAY_S
    if days_left >= SOON_DAYS:
        return None
    day = datetime.fromtimestamp(ends_s, UTC).date()
    when = f"ends on {day}, in {days_left:.0f} days" if days_left >= 0 else f"has ended on {day}"
    return CertificateEnds(
        f"The server's certificate {when}: other machines then refuse the probe.", certificate.renewal
    )


def own_certificate(folder: Path, names: Iterable[str]) -> ServerCertificate:
    """Return the probe's own certificate in a folder; make it when there is none, for names and addresses of it.

    Raises `CertificateRefused` when OpenSSL is missing or fails, or when what is there cannot be used.
    """
    own = ServerCertificate(folder / "certificate.pem", folder / "key.pem", MAKE_ANEW)
    if not own.certificate.exists():
        _make(own, sorted(set(names)))
    own.require_usable()
    return own


def _make(own: ServerCertificate, names: list[str]) -> None:
    own.key.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    made = ServerCertificate(own.certificate.with_suffix(".tmp"), own.key.with_suffix(".tmp"))
    for path in (made.certificate, made.key):
        path.unlink(missing_ok=True)
    made.key.touch(mode=0o600)
    try:
        subprocess.run(_command(made, names), check=True, capture_output=True, text=True, timeout=OPENSSL_S)
    except (OSError, subprocess.SubprocessError) as error:
        why = getattr(error, "stderr", "") or str(error)
        remedy = "Install openssl, or name the hospital's files by server.certificate and server.certificate_key."
        raise CertificateRefused(f"No certificate could be made: {why.strip()[-300:]}.", remedy) from error
    for at, path in ((made.key, own.key), (made.certificate, own.certificate)):  # the certificate is what is looked for
        _synchronise(at)
        os.replace(at, path)
    _synchronise(own.key.parent)


def _command(made: ServerCertificate, names: list[str]) -> list[str]:
    subject = ",".join(filter(None, map(_alternative, names)))
    extensions = [*EXTENSIONS, *([f"subjectAltName={subject}"] if subject else [])]
    return [
        *("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-noenc"),
        *("-keyout", str(made.key), "-out", str(made.certificate), "-subj", "/CN=TSIS probe"),
        *("-days", str(days_from(datetime.now(UTC)))),
        *(part for one in extensions for part in ("-addext", one)),
    ]


def days_from(now: datetime) -> int:
    """Return for how many days a certificate is made at a time by the board's clock, which may show 1970."""
    return DAYS + max(0, (NOT_BEFORE - now).days)


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
