"""Connections that take too long, over real sockets: let go by what they do, while others are answered."""

import contextlib
import socket
import threading
import time

import pytest
import uvicorn
from daemon_process import wait_for

from device.access.request_rules import BODY_RULES
from device.web.entrance import connection
from device.web.entrance.connection import PatientProtocol

STREAMED = next(path for path, rule in BODY_RULES.items() if rule.streamed)
WAIT_S = 60.0
PIECE, MANY = b"x" * 65536, 1000


async def app(scope, receive, send):
    """Read the whole body, then answer; `/long` with more than any buffer holds."""
    while (await receive()).get("more_body"):
        pass
    await send({"type": "http.response.start", "status": 200, "headers": []})
    for _ in range(MANY if scope["path"] == "/long" else 0):
        await send({"type": "http.response.body", "body": PIECE, "more_body": True})
    await send({"type": "http.response.body", "body": b"done"})


class ServedPort(int):
    """A port's number, with the connections of its server."""


@pytest.fixture
def port(monkeypatch):
    """A server whose patience is short."""
    for name, value in {"HEAD_S": 0.5, "SILENT_S": 0.5, "BODY_S": 1.0, "UNREAD_S": 0.5, "LOOK_S": 0.1}.items():
        monkeypatch.setattr(connection, name, value)
    listening = socket.create_server(("127.0.0.1", 0))
    settings = uvicorn.Config(app, http=PatientProtocol, ws="none", lifespan="off", log_config=None, access_log=False)
    server = uvicorn.Server(settings)
    serving = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    serving.start()
    port = ServedPort(listening.getsockname()[1])
    port.connections = server.server_state.connections
    yield port
    server.should_exit = True
    serving.join()
    listening.close()


@contextlib.contextmanager
def connected(port, *sent):
    with socket.create_connection(("127.0.0.1", int(port)), WAIT_S) as line:
        for part in sent:
            line.sendall(part)
        yield line


def is_let_go(line):
    """Wait until the server has ended a connection; return whether it said anything before."""
    said = b""
    with contextlib.suppress(ConnectionResetError):
        while part := line.recv(65536):
            said += part
    return said == b""


def is_answered(port):
    with connected(port, b"GET / HTTP/1.1\r\nhost: x\r\nconnection: close\r\n\r\n") as line:
        return b"200 OK" in line.recv(65536)


@pytest.mark.parametrize(
    "sent",
    [
        b"",
        b"G",
        b"GET / HTTP/1.1\r\nhost: x\r\n",
        b"POST / HTTP/1.1\r\nhost: x\r\ncontent-length: 9\r\n\r\nhalf",
        b"POST " + STREAMED.encode() + b" HTTP/1.1\r\nhost: x\r\ncontent-length: 9\r\n\r\nhalf",
    ],
)
def test_who_does_not_go_on_is_let_go(port, sent):
    with connected(port, sent) as line:
        assert is_answered(port)
        assert is_let_go(line)


@pytest.mark.parametrize(
    "head", [b"GET / HTTP/1.1\r\nhost: x\r\nx: ", b"POST / HTTP/1.1\r\nhost: x\r\ncontent-length: 65000\r\n\r\n"]
)
def test_who_sends_drop_by_drop_is_let_go(port, head):
    def is_open(line):
        try:
            line.sendall(b"x")
        except (ConnectionResetError, BrokenPipeError):
            return False
        return True

    with connected(port, head) as line:
        wait_for(lambda: is_open(line), lambda still: not still)


def test_a_streamed_body_may_take_longer_as_long_as_it_goes_on(port):
    count = 40
    head = f"POST {STREAMED} HTTP/1.1\r\nhost: x\r\nconnection: close\r\ncontent-length: {count}\r\n\r\n".encode()
    with connected(port, head) as line:
        for _ in range(count):
            line.sendall(b"x")
            time.sleep(0.05)
        assert b"200 OK" in line.recv(65536)


def test_who_does_not_read_is_let_go(port):
    with connected(port, b"GET /long HTTP/1.1\r\nhost: x\r\n\r\n") as line:
        assert is_answered(port)
        wait_for(lambda: port.connections, lambda found: not found)
        with contextlib.suppress(ConnectionResetError):
            while line.recv(2**20):
                pass  # what was on its way, and then the end


def test_a_connection_is_used_again_and_then_let_go(port):
    request = b"GET / HTTP/1.1\r\nhost: x\r\n\r\n"
    with connected(port, request) as line:
        for _ in range(2):
            said = b""
            while not said.endswith(b"done\r\n0\r\n\r\n"):
                said += line.recv(65536)
            assert said.startswith(b"HTTP/1.1 200 OK")
            line.sendall(request)
        is_let_go(line)
