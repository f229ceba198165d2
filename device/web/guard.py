"""Stands before every route: refuses what no own page and no program sends, who has no token, and too large bodies.

What is refused, and why: device/access/request_rules.py; who is asked for a token: device/web/entrance/door.py. Each
request is a line of the log, without its query, which may say whom it is about. It is pure ASGI, so that a stream stays
one and a body that is refused is never read.
"""

from __future__ import annotations

import json
import logging
from collections import Counter
from collections.abc import Callable, Coroutine
from typing import Any
from urllib.parse import parse_qsl

from fastapi import Request, Response
from fastapi.responses import RedirectResponse
from fastapi.routing import APIRoute
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from device.access.known_hosts import KnownHosts, split_authority
from device.access.request_rules import ENDLESS, AskedRequest, BodyRule, joined, require_allowed, too_large
from device.access.safe_headers import SAFE_HEADERS
from device.access.scopes import OPEN_FOLDER, PAIRING_PAGE
from device.errors import DeviceError, InvalidRequest, TokenNeeded, UnencryptedRequest
from device.records.audit import done_for
from device.web.entrance.door import Client, Door
from device.web.entrance.network import ServedNetwork
from device.web.entrance.open_answers import OpenAnswers
from device.web.entrance.request_line import RequestLine
from device.web.problems import problem

log = logging.getLogger(__name__)
NO_STORE = (b"cache-control", b"no-store")
HEADERS = [(name.encode(), value.encode()) for name, value in SAFE_HEADERS.items()]


class RequestGuard:
    """The application behind its rules."""

    def __init__(
        self,
        app: ASGIApp,
        hosts: KnownHosts,
        door: Door | None = None,
        answers: OpenAnswers | None = None,
        network: ServedNetwork | None = None,
    ) -> None:
        """Take what answers when the rules hold, under which names this machine may be asked, and who is let in."""
        self._app, self._hosts, self._door = app, hosts, door or Door()
        self._answers, self._network = answers or OpenAnswers(), network

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer with a problem document, or let the application answer; either way with the safe headers."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        request, line = asked(scope), RequestLine()
        noting = line.noting(_with_safe_headers(send, request.path, line.id))
        if scope["method"] == "HEAD" and request.path not in ENDLESS:
            scope, noting = {**scope, "method": "GET"}, _without_body(noting)
        try:
            require_allowed(request, self._hosts)
            client = self._door.require(request)
            line.client = client.name
            _require_each_once(scope)
            bounded = await _bounded(request, receive)
        except DeviceError as error:
            log.warning("%s %s", error.code, ascii(str(error))[1:-1])  # what a stranger sent begins no line of its own
            await self._refusal(request, error)(scope, receive, noting)
        else:
            with done_for(client.name):
                telling = _with_headers(noting, _token_headers(client))
                await self._answers.answer(
                    client.token_id, telling, lambda to: self._app(scope, bounded, to), valid_s=client.valid_s
                )
        finally:
            line.write(request.method, scope)

    def _refusal(self, request: AskedRequest, error: DeviceError) -> Response:
        """Return the problem, or for the screen the way to where it can be had."""
        if request.path == "/" and request.is_safe:
            if isinstance(error, UnencryptedRequest) and self._network:
                name, _ = split_authority(request.headers.get("host", ""))
                return RedirectResponse(self._network.url_for(name), 307)
            if isinstance(error, TokenNeeded):
                return RedirectResponse(PAIRING_PAGE, 303)
        return problem(error)


class StrictRoute(APIRoute):
    """A route whose JSON body must say each thing once: of a key that is there twice, parsers take either."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return what answers a request of the route."""
        handle = super().get_route_handler()

        async def handle_strictly(request: Request) -> Response:
            return await handle(_StrictRequest(request.scope, request.receive))

        return handle_strictly


class _StrictRequest(Request):
    async def json(self) -> Any:
        body = await self.body()
        try:
            said = json.loads(body.decode("utf-8-sig"), object_pairs_hook=_each_key_once)
        except json.JSONDecodeError:
            raise
        except (ValueError, RecursionError) as error:  # no text, a number of thousands of digits, or nested too deep
            raise json.JSONDecodeError(f"it is no JSON that can be read ({type(error).__name__})", "", 0) from None
        if said is None:
            raise json.JSONDecodeError("it is null: send no body where nothing is to be said", "", 0)
        return said


def _each_key_once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise json.JSONDecodeError(f"the key {twice!a} is there twice", "", 0)
    return found


def asked(scope: Scope) -> AskedRequest:
    """Return what an ASGI request says of itself."""
    headers = joined((name.decode("latin-1"), value.decode("latin-1")) for name, value in scope["headers"])
    served_at, client = ((scope.get(end) or (None,))[0] for end in ("server", "client"))
    is_encrypted, version = scope.get("scheme") == "https", scope.get("http_version", "1.1")
    return AskedRequest(scope["method"], scope["path"], headers, served_at, client, is_encrypted, version)


async def _bounded(request: AskedRequest, receive: Receive) -> Receive:
    """Return what hands out the body; raises `BodyTooLarge` when it is larger than it said, or never said.

    A streamed one raises while it is read, by its route. Any other that does not say its size is read here, up to
    what is allowed: a route's own reader would make another error of it.
    """
    if request.rule.streamed:
        return _counted(request.rule, receive)
    if "transfer-encoding" not in request.headers:
        return receive  # the server itself holds a body to the size that it states
    body = bytearray()
    counted, is_more = _counted(request.rule, receive), True
    while is_more:
        message = await counted()
        if message["type"] != "http.request":
            return _replayed(message, receive)
        body += message.get("body", b"")
        is_more = message.get("more_body", False)
    return _replayed({"type": "http.request", "body": bytes(body), "more_body": False}, receive)


def _counted(rule: BodyRule, receive: Receive) -> Receive:
    read = 0

    async def counting() -> Message:
        nonlocal read
        message = await receive()
        read += len(message.get("body", b""))
        if read > rule.max_bytes:
            raise too_large(rule)
        return message

    return counting


def _replayed(message: Message, receive: Receive) -> Receive:
    """Return what gives a message that was read already, then what comes."""
    read = [message]

    async def replaying() -> Message:
        return read.pop() if read else await receive()

    return replaying


def _require_each_once(scope: Scope) -> None:
    """Raise `InvalidRequest` for a parameter that is there twice: routes take the last of them without a word."""
    names = [name for name, _ in parse_qsl(scope.get("query_string", b"").decode("latin-1"), keep_blank_values=True)]
    if len(set(names)) < len(names):
        name, count = Counter(names).most_common(1)[0]
        raise InvalidRequest(f"query.{name[:80]} is there {count} times.", "Give it once.")


def _without_body(send: Send) -> Send:
    """Return what sends the headers of an answer alone, for HEAD (RFC 9110 section 9.3.2)."""

    async def sending(message: Message) -> None:
        await send({**message, "body": b""} if message["type"] == "http.response.body" else message)

    return sending


def _token_headers(client: Client) -> list[tuple[bytes, bytes]]:
    """Return what tells a client that its token ends soon, and when."""
    return [(b"token-expires", client.ends_at.encode())] if client.ends_at else []


def _with_headers(send: Send, more: list[tuple[bytes, bytes]]) -> Send:
    """Return what sends an answer with some headers more."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", []), *more]}
        await send(message)

    return sending


def _with_safe_headers(send: Send, path: str, request_id: str) -> Send:
    """Return what sends an answer with the safe headers; whatever may be of a patient is kept by no browser."""
    whole = _with_headers(send, [*HEADERS, (b"x-request-id", request_id.encode())])
    is_file = path.startswith(OPEN_FOLDER)

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start" and not is_file:
            kept = [one for one in message.get("headers", []) if one[0].lower() != b"cache-control"]
            message = {**message, "headers": [*kept, NO_STORE]}
        await whole(message)

    return sending
