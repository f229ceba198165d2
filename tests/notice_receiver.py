"""An address of a hospital that gets notices: a real HTTP server in a thread, which verifies what it gets."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import ssl
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

SECRET = b"a secret of thirty-two bytes, ok"


def write_secret(folder: Path) -> Path:
    file = folder / "webhook.secret"
    file.write_text(f"whsec_{base64.b64encode(SECRET).decode()}\n")
    file.chmod(0o640)
    return file


class NoticeReceiver:
    """Keeps each notice that it takes, in order; `status` is what it answers with."""

    def __init__(self, port: int = 0, certificate: tuple[Path, Path] | None = None) -> None:
        self.status, self.headers, self.is_silent = 204, dict[str, str](), False
        self.taken: list[dict[str, Any]] = []
        self.asked = 0
        self._let_go = threading.Event()
        self._server = ThreadingHTTPServer(("127.0.0.1", port), self._handler())
        self._server.daemon_threads = False  # they are waited for at the end
        self.port, scheme = self._server.server_address[1], "http"
        if certificate:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*certificate)
            self._server.socket = context.wrap_socket(self._server.socket, server_side=True)
            scheme = "https"
        self.url = f"{scheme}://127.0.0.1:{self.port}/tsis"
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.02})
        self._thread.start()

    def close(self) -> None:
        self._let_go.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def ids(self) -> list[str]:
        return [one["webhook-id"] for one in self.taken]

    def types(self) -> list[str]:
        return [one["type"] for one in self.taken]

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        receiver = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                receiver.asked += 1
                body = self.rfile.read(int(self.headers["content-length"]))
                if receiver.is_silent:
                    receiver._let_go.wait()
                    return
                if receiver.status == 204:
                    receiver.taken.append({**verified(dict(self.headers), body), "path": self.path})
                self.send_response(receiver.status)
                for name, value in receiver.headers.items():
                    self.send_header(name, value)
                self.end_headers()

            def log_message(self, *_: object) -> None:
                pass

        return Handler


def verified(headers: dict[str, str], body: bytes) -> dict[str, Any]:
    """Return a notice as a receiver reads it, with its id and all that was sent; fail when its signature is wrong."""
    signed = b".".join([headers["webhook-id"].encode(), headers["webhook-timestamp"].encode(), body])
    right = base64.b64encode(hmac.new(SECRET, signed, hashlib.sha256).digest()).decode()
    assert headers["webhook-signature"] == f"v1,{right}"
    return {**json.loads(body), "webhook-id": headers["webhook-id"], "sent": body.decode() + str(headers)}
