"""Why TLS with another program does not come about, found by a handshake that carries nothing.

Libraries tell a refused certificate as a connection that failed. So this is asked afterwards, only to say why.
Sources: OpenSSL, X509_STORE_CTX_get_error(3), for codes of certificates; RFC 8446 section 6.2 for alerts. In TLS 1.3 a
program judges this one's certificate only behind the handshake, so its alert comes with the first answer.
"""

from __future__ import annotations

import socket
import ssl
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Literal

LOOK_S, ALERT_S = 5.0, 2.0
"""How long connecting and the handshake may each take, and how long an alert behind it is waited for."""
TlsProblem = Literal["untrusted", "expired", "not_yet_valid", "other_name", "own_refused", "no_tls", "other"]
PROBLEMS: dict[int, TlsProblem] = {
    9: "not_yet_valid", 10: "expired", 18: "untrusted", 19: "untrusted", 20: "untrusted", 21: "untrusted",
    62: "other_name", 64: "other_name",
}  # fmt: skip
ALERTS_OF_OWN = (
    "CERTIFICATE_REQUIRED", "BAD_CERTIFICATE", "UNSUPPORTED_CERTIFICATE", "CERTIFICATE_REVOKED", "CERTIFICATE_EXPIRED",
    "CERTIFICATE_UNKNOWN", "UNKNOWN_CA", "ACCESS_DENIED", "DECRYPT_ERROR", "HANDSHAKE_FAILURE", "NO_CERTIFICATE",
)  # fmt: skip
"""What a program answers that does not take the certificate of whoever asks, or misses one; handshake_failure, which
TLS 1.2 has for the latter, may mean no common cipher, too."""
NOT_TLS = ("WRONG_VERSION_NUMBER", "UNEXPECTED_EOF", "RECORD_LAYER", "HTTP_REQUEST", "PACKET_LENGTH", "EOF occurred")
ENDED = ssl.SSLEOFError, ssl.SSLZeroReturnError
"""What a connection is that ends in the handshake: the first by Python 3.11.7, the second by 3.11.2, Debian 12's."""


@dataclass(frozen=True)
class TlsFailure:
    """What is wrong, and what the other program does, as the rest of a sentence."""

    problem: TlsProblem
    why: str


def tls_failure(context: ssl.SSLContext, host: str, port: int) -> TlsFailure | None:
    """Return why a handshake with a program fails; None where it does not, or the network may be what fails."""
    try:
        connection = socket.create_connection((host, port), timeout=LOOK_S)
    except OSError:
        return None
    with connection:
        try:
            with context.wrap_socket(connection, server_hostname=host) as encrypted:
                return _refusal(encrypted)
        except ssl.SSLCertVerificationError as error:
            return _of_certificate(error)
        except ssl.SSLError as error:
            return _of_handshake(error)
        except OSError:  # silent or reset: a busy program or a lost link, which say nothing of TLS
            return None


def _refusal(encrypted: ssl.SSLSocket) -> TlsFailure | None:
    """Return what a program says behind the handshake; one that takes it waits to be asked."""
    encrypted.settimeout(ALERT_S)
    try:
        encrypted.recv(1)
    except TimeoutError:
        return None
    except ConnectionError:  # a reset may be faster than the alert before it
        return TlsFailure("own_refused", "broke the connection off as it saw this probe's certificate, or none")
    return None


def _of_certificate(error: ssl.SSLCertVerificationError) -> TlsFailure:
    problem, said = PROBLEMS.get(error.verify_code, "other"), error.verify_message
    by_clock = f"by this probe's clock, {datetime.now(UTC):%Y-%m-%d %H:%M} UTC"
    why = {
        "untrusted": f"has a certificate that this probe does not trust ({said})",
        "expired": f"has a certificate that has expired {by_clock}",
        "not_yet_valid": f"has a certificate that is not valid yet {by_clock}",
        "other_name": f"has a certificate for another name ({said.rstrip('.')})",
    }
    return TlsFailure(problem, why.get(problem, f"has a certificate that is not accepted ({said})"))


def _of_handshake(error: ssl.SSLError) -> TlsFailure:
    said = error.reason or str(error)
    if any(one in said for one in ALERTS_OF_OWN):
        return TlsFailure("own_refused", f"does not accept this probe's certificate, or misses one ({said})")
    if isinstance(error, ENDED) or any(one in said for one in NOT_TLS):
        return TlsFailure("no_tls", f"does not speak TLS at this port ({said})")
    return TlsFailure("other", f"and this probe do not agree on TLS ({said})")
