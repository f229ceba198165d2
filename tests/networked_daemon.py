"""A daemon that serves the network, asked at an address of this machine that is none of loopback, as others ask it."""

from __future__ import annotations

import json
import os
import socket
import ssl
from pathlib import Path
from typing import Any

import httpx
import pytest
from daemon_process import PATIENT, QUICK_HAND, ROOT, WAIT_S, Daemon


def own_address() -> str:
    """Return an address of this machine by which it asks itself as another machine would; skip where it has none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.connect(("192.0.2.1", 9))  # sends nothing: it only says by which address that would be
            found = str(line.getsockname()[0])
        except OSError:
            found = "127.0.0.1"
    if found.startswith("127."):
        assert not os.environ.get("TSIS_REQUIRE_PEERS"), "an address besides loopback is required here"
        pytest.skip("this machine has no address but loopback")
    return found


class NetworkedDaemon:
    """A simulated probe at `0.0.0.0`, and a client of it at this machine's own address, by TLS."""

    def __init__(self, folder: Path, more: str = "", *, host: str = "0.0.0.0") -> None:
        self.address, self.folder = own_address(), folder
        (folder / "scene.toml").write_text(QUICK_HAND + PATIENT)
        certificate = ROOT / "models" / "simulated_probe" / "calibration.json"
        settings = f'serial = "SIM-0001"\ndata = "var"\ncalibration = "{certificate}"\n'
        (folder / "probe.toml").write_text(f'{settings}[server]\nhost = "{host}"\nport = 0\ntls_port = 0\n{more}')
        arguments = ("--simulate", "--scene", "scene.toml", "--config", "probe.toml")
        self.daemon = Daemon(folder, arguments=arguments)
        words = self.daemon.greeting.split()
        self.tls_port = int(next(word for word in words if word.startswith("https:")).rstrip("/").rpartition(":")[2])
        self.port = int(self.daemon.url.rpartition(":")[2])
        self.url = f"https://{self.address}:{self.tls_port}"

    @property
    def trust(self) -> ssl.SSLContext:
        """What trusts the probe's own certificate and no other, whatever name it is asked by."""
        trust = ssl.create_default_context(cafile=self.folder / "var" / "tls" / "certificate.pem")
        trust.check_hostname = False  # an address that was not known when it was made
        return trust

    def ask(self, method: str, path: str, body: object = None, **headers: str) -> httpx.Response:
        """Ask as another machine does."""
        said = {"content-type": "application/json", **headers}
        with httpx.Client(verify=self.trust, timeout=WAIT_S) as client:
            content = None if body is None else json.dumps(body)
            return client.request(method, f"{self.url}{path}", headers=said, content=content)

    def token(self, scope: str) -> dict[str, Any]:
        """Pair as another machine, with a code of the own screen."""
        code = self.daemon.ask("/api/v1/pairing", "POST", {"name": f"{scope} PC", "scope": scope}).json["code"]
        made = self.ask("POST", "/api/v1/pairing/claim", {"code": code})
        assert made.status_code == 201, made.text
        found: dict[str, Any] = made.json()
        return found
