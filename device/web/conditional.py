"""Answers that a client has already: their ETag, If-None-Match, and 304 (RFC 9110, section 13).

Whatever route's document says that its answer has an ETag is asked for so. What has a version of its own has that as
its tag, as the exam that a change must name; any other has the hash of its content.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from hashlib import sha256
from typing import Any

from fastapi import Request, Response

from device.web.guard import StrictRoute


class ConditionalRoute(StrictRoute):
    """A route that does not send again what its client has."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return what answers a request of the route."""
        handle = super().get_route_handler()
        described: dict[str, Any] = self.responses.get(200, {})
        if self.methods != {"GET"} or "ETag" not in described.get("headers", {}):
            return handle

        async def handle_conditionally(request: Request) -> Response:
            return answer_or_unchanged(await handle(request), request.headers.get("if-none-match", ""))

        return handle_conditionally


def answer_or_unchanged(answer: Response, known: str) -> Response:
    """Return an answer with its ETag, or 304 without content when it is among the tags that the client knows."""
    if answer.status_code != 200:
        return answer
    if "etag" not in answer.headers:
        answer.headers["ETag"] = f'"{sha256(answer.body).hexdigest()[:32]}"'
    tag = answer.headers["etag"]
    tags = [one.strip().removeprefix("W/") for one in known.split(",")]
    return Response(status_code=304, headers={"ETag": tag}) if tag in tags or known.strip() == "*" else answer
