"""The fallback's server: the daemon's port while the daemon has it not, by the same rules for every request.

It gives the port up when the daemon asks for it (device/fallback/handover.py), and takes it again when nobody has it.
"""

from __future__ import annotations

import errno
import json
import logging
import os
import socket
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from device.access.known_hosts import asked_at, is_loopback
from device.access.request_rules import AskedRequest, joined, require_allowed, require_local
from device.access.safe_headers import SAFE_HEADERS
from device.errors import DeviceError, UnknownPath
from device.fallback.actions import has_support, roll_back, support_file
from device.fallback.address import ServedAddress, read_address
from device.fallback.page import STATUS, page, problem, revision
from device.fallback.situation import Situation, read_situation
from device.fallback.words import LANGUAGES, PageWords, wished_language
from device.files.plain_settings import HOST, data_folder
from device.files.screen_choices import ScreenChoices, read_choices

log = logging.getLogger(__name__)
API, OWN = "/api/v1", "/fallback"
LIVE, STATE, YIELD = f"{OWN}/live", f"{OWN}/state", f"{OWN}/yield"
SCREEN_CSS = Path(__file__).parents[1] / "web" / "static" / "screen.css"
STATIC = Path(__file__).parent / "static"
KINDS = {".css": "text/css", ".js": "text/javascript"}
MOST_REQUESTS = 32
REQUEST_S = 10.0
LOOK_S = 0.5
"""How often it is looked whether the port is free."""
GIVEN_UP_S = 5.0
"""So long the port is left to a daemon that has asked for it."""
TAKEN_LOOK_S = 0.1
KNOWN_S = 1.0
"""So long what is known is not asked for again: systemd is asked by a command."""


class FallbackServer(ThreadingHTTPServer):
    """Serves what is known below `root` on a socket that listens; `is_asked_for` once the daemon wants the port."""

    daemon_threads = True

    def __init__(self, listening: socket.socket, address: ServedAddress, root: Path) -> None:
        super().__init__(listening.getsockname()[:2], FallbackRequest, bind_and_activate=False)
        self.socket.close()
        self.socket, self.address, self.root = listening, address, root
        self.hosts = address.known_hosts
        self.timeout = LOOK_S
        self.is_asked_for = False
        self._places = threading.Semaphore(MOST_REQUESTS)
        self._known: tuple[float, Situation] | None = None
        self._asking = threading.Lock()

    def situation(self) -> Situation:
        """Return what is known, a second old at most."""
        with self._asking:
            if not self._known or time.monotonic() - self._known[0] > KNOWN_S:
                self._known = time.monotonic(), read_situation(self.root)
            return self._known[1]

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer in a thread of its own; with too many under way, only who asks from this machine."""
        is_counted = self._places.acquire(blocking=False)
        if not is_counted and not is_loopback(client_address[0]):
            self.shutdown_request(request)
            return
        threading.Thread(target=self._process, args=(request, client_address, is_counted), daemon=True).start()

    def _process(self, request: Any, client_address: Any, is_counted: bool) -> None:
        try:
            self.process_request_thread(request, client_address)
        finally:
            if is_counted:
                self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say in the log that a request came to nothing, as when a client goes."""
        log.info("a request of %s came to nothing", client_address[0], exc_info=True)


class FallbackRequest(BaseHTTPRequestHandler):
    """One request, and the end of its connection."""

    server: FallbackServer
    timeout = REQUEST_S
    server_version, sys_version = "TSIS", ""

    def do_GET(self) -> None:
        """Answer with the page, one of its files, or a problem."""
        self._answer(self._get)

    do_HEAD = do_GET  # noqa: N815 - the base class calls it so

    def do_POST(self) -> None:
        """Do what is asked for at the probe itself, or answer with a problem."""
        self._answer(self._post)

    do_PUT = do_PATCH = do_DELETE = do_POST  # noqa: N815 - as above

    def log_message(self, format: str, *args: Any) -> None:
        """Leave the log to what matters."""

    def _answer(self, how: Any) -> None:
        asked = self._asked()
        try:
            require_allowed(asked, self.server.hosts)
            how(asked)
        except DeviceError as error:
            body = {"type": "about:blank", "title": error.title, "status": error.status, "detail": error.cause}
            self._send_json({**body, "code": error.code, "remedy": error.remedy}, error.status, "problem+json")

    def _asked(self) -> AskedRequest:
        path = self.path.partition("?")[0]
        served_at = str(self.connection.getsockname()[0])
        headers, version = joined(self.headers.items()), self.request_version.removeprefix("HTTP/")
        return AskedRequest(self.command, path, headers, served_at, self.client_address[0], False, version)

    def _get(self, asked: AskedRequest) -> None:
        if asked.path == LIVE:  # a daemon that starts waits for this one: systemd is not asked first
            self._send_json({"fallback": True})
            return
        situation = self.server.situation()
        static = STATIC / Path(asked.path).name
        if asked.path == STATE:
            self._send_json({"revision": revision(situation)})
        elif asked.path.startswith(f"{API}/"):
            self._send_json(problem(situation), STATUS, "problem+json")
        elif asked.path == "/static/screen.css":
            self._send(SCREEN_CSS.read_bytes() if SCREEN_CSS.is_file() else b"", KINDS[".css"])
        elif asked.path == f"/static/{static.name}" and static.suffix in KINDS and static.is_file():
            self._send(static.read_bytes(), KINDS[static.suffix])
        elif asked.path == "/":
            self._send(self._page(asked, situation).encode(), "text/html; charset=utf-8", STATUS)
        else:
            raise _unknown(asked)

    def _page(self, asked: AskedRequest, situation: Situation) -> str:
        """Return the page; of the own screen in the language and colours that were chosen there."""
        kept = read_choices(data_folder(self.server.root)) if asked.is_own_screen else ScreenChoices()
        said = parse_qs(self.path.partition("?")[2]).get("language", [""])[-1]  # by the page itself (fallback.js)
        language = next((one for one in (said, kept.language) if one in LANGUAGES), None)
        words = PageWords(language or wished_language(self.headers.get("accept-language", "")))
        options = {"is_local": asked.is_own_screen, "has_support": has_support()}
        return page(situation, self.server.address, words, colours=kept.colours or "auto", **options)

    def _post(self, asked: AskedRequest) -> None:
        if asked.path == YIELD:
            if asked.client != asked.served_at:  # so a daemon asks that serves one address of the network only
                require_local(asked)
            self.server.is_asked_for = True
            self._send_json({})
        elif asked.path == f"{API}/updates/roll-back":
            require_local(asked)
            roll_back(self.server.root, self.server.situation())
            self._send_json({}, 202)
        elif asked.path == f"{OWN}/support":
            require_local(asked)
            self._send(support_file(), "application/zip")
        elif asked.path.startswith(f"{API}/"):
            self._send_json(problem(self.server.situation()), STATUS, "problem+json")
        else:
            raise _unknown(asked)

    def _send_json(self, record: dict[str, Any], status: int = 200, kind: str = "json") -> None:
        self._send(json.dumps(record).encode(), f"application/{kind}", status)

    def _send(self, content: bytes, kind: str, status: int = 200) -> None:
        self.send_response(status)
        for name, value in {**SAFE_HEADERS, "content-type": kind, "cache-control": "no-store"}.items():
            self.send_header(name, value)
        if status == STATUS:
            self.send_header("retry-after", "5")
        self.send_header("content-length", str(len(content)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)


def _unknown(asked: AskedRequest) -> UnknownPath:
    return UnknownPath(f"{asked.method} {asked.path[:100]} is not there while the probe does not run.", "Begin at /.")


def listen(address: ServedAddress) -> socket.socket:
    """Take the daemon's port; where its host cannot be had, on loopback. Raises `OSError` when somebody else has it."""
    try:
        return _listening(address.host, address.port)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise
        return _listening(HOST, address.port)


def _listening(host: str, port: int) -> socket.socket:
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        listening.bind((host, port))
        listening.listen()
    except OSError:
        listening.close()
        raise
    return listening


def serve_until(stop: threading.Event, root: Path = Path("/")) -> None:
    """Serve whenever nobody else has the port, until told to stop."""
    notify("READY=1")
    while not stop.is_set():
        notify("WATCHDOG=1")
        address = read_address(root)
        try:
            listening = listen(address)
        except OSError:
            stop.wait(LOOK_S)
            continue
        log.info("the probe's software has not its port %d: the fallback serves it", address.port)
        _serve(FallbackServer(listening, address, root), stop)
        _leave(address, stop)


def _serve(server: FallbackServer, stop: threading.Event) -> None:
    with server:
        while not (stop.is_set() or server.is_asked_for):
            server.handle_request()
            notify("WATCHDOG=1")


def _leave(address: ServedAddress, stop: threading.Event) -> None:
    """Return when the daemon that has asked for the port has it, or does not take it."""
    until_s = time.monotonic() + GIVEN_UP_S
    while time.monotonic() < until_s and not stop.wait(TAKEN_LOOK_S):
        try:
            socket.create_connection((asked_at(address.host), address.port), REQUEST_S).close()
        except OSError:
            continue
        return


def notify(text: str) -> None:
    """Tell systemd, if it started this (sd_notify(3))."""
    place = os.environ.get("NOTIFY_SOCKET")
    if not place:
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as line:
        line.sendto(text.encode(), f"\0{place[1:]}" if place.startswith("@") else place)
