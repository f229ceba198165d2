"""The address that gets notices: one POST each, by TLS whose certificate is checked, and nowhere else.

The standard library's client follows no redirect and asks no proxy; both would bring a notice to another host.
"""

from __future__ import annotations

import http.client
import ssl
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import urlsplit

from device.errors import WebhookFailed

TIMEOUT_S = 10.0
"""So long the address may keep silent."""
LOOK = "See that it is reached from the probe, and what its own log says; notices wait until then."


class WebhookAddress:
    """Where notices go. One object serves one thread."""

    def __init__(self, url: str, tls_authority: Path | None = None) -> None:
        """Take an address by https, or by http on this machine, and who signs its certificate."""
        self._place, self._authority = urlsplit(url), tls_authority

    def __str__(self) -> str:
        """Return host and port: a path may be a secret of the receiver's."""
        return self._place.netloc

    def post(self, body: bytes, headers: Mapping[str, str]) -> None:
        """Send a body; raise `WebhookFailed` unless the answer is that it was taken (200 to 299)."""
        of_all = {"Content-Type": "application/json", "User-Agent": "TSIS", "Connection": "close", **headers}
        try:
            connection = self._connection()
            try:
                connection.request("POST", self._place.path or "/", body, of_all)
                status = connection.getresponse().status
            finally:
                connection.close()
        except (OSError, http.client.HTTPException) as error:
            raise WebhookFailed(f"{self} does not take notices: {_why(error)}.", LOOK) from error
        if not 200 <= status < 300:
            leads = " It leads elsewhere, where nothing is sent." if 300 <= status < 400 else ""
            raise WebhookFailed(f"{self} answers with {status}, not that it has the notice.{leads}", LOOK)

    def _connection(self) -> http.client.HTTPConnection:
        host, port = self._place.hostname or "", self._place.port
        if self._place.scheme != "https":
            return http.client.HTTPConnection(host, port, timeout=TIMEOUT_S)
        context = ssl.create_default_context(cafile=self._authority)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        return http.client.HTTPSConnection(host, port, timeout=TIMEOUT_S, context=context)


def _why(error: Exception) -> str:
    """Return why a connection failed, without anything that the other side has written."""
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"its certificate is refused, {error.verify_message.rstrip('.')}"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    return "no answer in time" if isinstance(error, TimeoutError) else type(error).__name__
