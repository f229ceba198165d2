"""A line of the log for each request: who asked for what, and how it was answered; nothing that a request carries.

Neither the query nor the body nor an identifier in the path is in it, but the route's template: an address in a log
must not say whom it is about. The answer has the line's `id` as `X-Request-Id`.
"""

from __future__ import annotations

import logging
import secrets
import time

from starlette.types import Message, Scope, Send

from device.access.scopes import OPEN_FOLDER

log = logging.getLogger(__name__)


class RequestLine:
    """What is known of one request, until it is written."""

    def __init__(self) -> None:
        self.id, self.client = secrets.token_hex(6), "nobody"
        self._begun_s, self._status, self._bytes = time.monotonic(), 0, 0

    def noting(self, send: Send) -> Send:
        """Return what sends an answer and notes how it was."""

        async def sending(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._status = message["status"]
            self._bytes += len(message.get("body", b""))
            await send(message)

        return sending

    def write(self, method: str, scope: Scope) -> None:
        """Write the line; an answer that never began, as of a client that has gone, has the status 0."""
        took_ms = 1000 * (time.monotonic() - self._begun_s)
        log.info(
            "request id=%s method=%s route=%s status=%d bytes=%d ms=%.0f client=%s",
            *(self.id, method, _route(scope), self._status, self._bytes, took_ms, quoted(self.client)),
        )


def quoted(text: str) -> str:
    """Return a value of a line: in quotes where it is more than one word."""
    return text if text.replace("-", "").replace("_", "").isalnum() else repr(text)


def _route(scope: Scope) -> str:
    template = getattr(scope.get("route"), "path", None)
    if template:
        return str(template)
    path = str(scope["path"])
    return path if path == "/" else f"{OPEN_FOLDER}*" if path.startswith(OPEN_FOLDER) else "none"
