"""The guard before every route: what it refuses never reaches a route, and what is too large is never read."""

import asyncio
import json

import pytest

from device.access.known_hosts import KnownHosts
from device.access.request_rules import BODY_RULES, JSON_BODY
from device.access.safe_headers import SAFE_HEADERS
from device.errors import BodyTooLarge
from device.web.guard import RequestGuard

LIMIT = JSON_BODY.max_bytes


class Conversation:
    """One request to a guarded application that reads its whole body; what was read, and what was answered."""

    def __init__(self, chunks, headers, path="/api/v1/presses", method="POST"):
        self.chunks, self.asked_for, self.body, self.sent = list(chunks), 0, None, []
        stated = {"host": "localhost", "content-type": "application/json", **headers}
        encoded = [(name.encode(), value.encode()) for name, value in stated.items()]
        self.scope = {"type": "http", "method": method, "path": path, "headers": encoded, "client": ("127.0.0.1", 9)}
        self.refusal = None
        asyncio.run(RequestGuard(self.app, KnownHosts.of_machine())(self.scope, self.receive, self.send))

    async def receive(self):
        self.asked_for += 1
        chunk = self.chunks.pop(0)
        return {"type": "http.request", "body": chunk, "more_body": bool(self.chunks)}

    async def app(self, scope, receive, send):
        body = b""
        while True:
            try:
                message = await receive()
            except BodyTooLarge as refusal:
                self.refusal = refusal
                return
            body += message["body"]
            if not message["more_body"]:
                break
        self.body = body
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"{}"})

    async def send(self, message):
        self.sent.append(message)

    @property
    def status(self):
        return self.sent[0]["status"]

    @property
    def headers(self):
        return {name.decode(): value.decode() for name, value in self.sent[0]["headers"]}


def test_a_body_that_says_it_is_too_large_is_refused_without_being_read():
    asked = Conversation([b"x"], {"content-length": str(LIMIT + 1)})
    assert (asked.asked_for, asked.body, asked.status) == (0, None, 413)
    assert asked.headers["content-type"] == "application/problem+json"
    problem = json.loads(asked.sent[1]["body"])
    assert (problem["code"], problem["status"]) == ("E809", 413)
    assert "64 kB" in problem["detail"]


def test_a_body_that_does_not_say_its_size_is_read_to_the_limit_and_no_further():
    asked = Conversation([b"x" * 1000] * 1000, {"transfer-encoding": "chunked"})
    assert (asked.body, asked.status) == (None, 413)
    assert asked.asked_for == LIMIT // 1000 + 1


@pytest.mark.parametrize("chunks", [[b"[1, ", b"2", b"]"], [b""], [b"x" * LIMIT]])
def test_a_small_body_arrives_as_it_was_sent(chunks):
    assert Conversation(chunks, {"transfer-encoding": "chunked"}).body == b"".join(chunks)
    assert Conversation(chunks, {"content-length": str(len(b"".join(chunks)))}).body == b"".join(chunks)


def test_a_client_that_goes_in_the_middle_of_its_body_is_told_to_the_application():
    told = []

    async def app(scope, receive, send):
        told.append(await receive())

    async def gone():
        return {"type": "http.disconnect"}

    headers = [(b"host", b"localhost"), (b"content-type", b"application/json"), (b"transfer-encoding", b"chunked")]
    scope = {"type": "http", "method": "POST", "path": "/", "headers": headers, "client": ("127.0.0.1", 9)}
    asyncio.run(RequestGuard(app, KnownHosts.of_machine())(scope, gone, None))
    assert told == [{"type": "http.disconnect"}]


def test_a_release_file_goes_through_in_pieces_and_too_large_a_one_is_told_to_its_route(monkeypatch):
    path = "/api/v1/updates"
    rule = BODY_RULES[path]
    headers = {"content-type": rule.content_type, "transfer-encoding": "chunked"}
    asked = Conversation([b"x" * LIMIT] * 3, headers, path)
    assert (len(asked.body), asked.asked_for) == (3 * LIMIT, 3)
    monkeypatch.setattr(
        "device.access.request_rules.BODY_RULES", {path: type(rule)(rule.content_type, 2 * LIMIT, True)}
    )
    asked = Conversation([b"x" * LIMIT] * 5, headers, path)
    assert (asked.body, asked.asked_for) == (None, 3)
    assert asked.refusal


@pytest.mark.parametrize("headers", [{}, {"host": "evil.example"}])
def test_every_answer_tells_a_browser_what_it_may_not_do_with_it(headers):
    asked = Conversation([b""], headers)
    assert asked.headers.items() >= SAFE_HEADERS.items()
    assert "frame-ancestors 'none'" in asked.headers["content-security-policy"]


def test_a_refused_request_does_not_reach_the_application():
    asked = Conversation([b""], {"host": "evil.example"})
    assert (asked.status, asked.asked_for, asked.body) == (421, 0, None)


@pytest.mark.parametrize("said", [[], [(b"cache-control", b"no-cache")], [(b"Cache-Control", b"max-age=9")]])
@pytest.mark.parametrize(("path", "is_kept"), [("/api/v1/exams", False), ("/", False), ("/static/screen.js", True)])
def test_no_browser_keeps_an_answer_but_the_screens_own_files(said, path, is_kept):
    sent = []

    async def app(scope, receive, send):
        await send({"type": "http.response.start", "status": 200, "headers": said})
        await send({"type": "http.response.body", "body": b"{}"})

    async def told(message):
        sent.append(message)

    headers = [(b"host", b"localhost")]
    scope = {"type": "http", "method": "GET", "path": path, "headers": headers, "client": ("127.0.0.1", 9)}
    asyncio.run(RequestGuard(app, KnownHosts.of_machine())(scope, None, told))
    found = [value for name, value in sent[0]["headers"] if name.lower() == b"cache-control"]
    assert found == ([value for _, value in said] if is_kept else [b"no-store"])


def test_a_request_is_a_line_of_the_log_without_its_query_and_the_answer_has_its_id(caplog):
    with caplog.at_level("INFO", "device.web.entrance.request_line"):
        asked = Conversation([b"{}"], {"content-length": "2"}, path="/api/v1/presses")
    [line] = [one.getMessage() for one in caplog.records if one.name.endswith("request_line")]
    assert line.startswith(f"request id={asked.headers['x-request-id']} method=POST route=none status=200 bytes=2 ms=")
    assert line.endswith("client=screen")
