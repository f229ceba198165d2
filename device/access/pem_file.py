"""A PEM file to the certificates in it: whose each is, and from when until when it holds. Read by OpenSSL's command."""

from __future__ import annotations

import logging
import re
import ssl
import subprocess
from dataclasses import dataclass
from pathlib import Path

log = logging.getLogger(__name__)
OPENSSL_S = 60.0
CERTIFICATE = re.compile(r"Not Before: (?P<begins>.+)\n\s*Not After : (?P<ends>.+)\n\s*Subject: *(?P<subject>.*)")
"""In what `openssl storeutl` prints of each. It escapes a line's end in a name, and its months are English anywhere."""


@dataclass(frozen=True)
class HeldPeriod:
    """Whose a certificate is, and from when until when it holds, in seconds since 1970."""

    subject: str
    begins_s: float
    ends_s: float


def held_periods(path: Path) -> tuple[HeldPeriod, ...]:
    """Return those of all certificates in a file, in its order; none where nobody can say, which is logged."""
    command = ["openssl", "storeutl", "-noout", "-text", "-certs", str(path.absolute())]
    try:
        said = subprocess.run(
            command, check=True, capture_output=True, text=True, timeout=OPENSSL_S, stdin=subprocess.DEVNULL
        ).stdout
        found = tuple(
            HeldPeriod(one["subject"], *(float(ssl.cert_time_to_seconds(one[end])) for end in ("begins", "ends")))
            for one in CERTIFICATE.finditer(said)
        )
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        log.warning("When the certificates in %s end cannot be read: %s", path, error)
        return ()
    if not found:
        log.warning("When the certificates in %s end cannot be read: there is none", path)
    return found
