"""Where the daemon would be reached: the few settings of the server, read without the daemon's packages.

The settings may be why the daemon does not start, so what cannot be read or used is passed over.
"""

from __future__ import annotations

import socket
import subprocess
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.access.known_hosts import ANYWHERE, KnownHosts

HOST, PORT = "127.0.0.1", 8000
FILES, DROP_INS = ("usr/lib/tsis/config.toml", "etc/tsis/config.toml"), "etc/tsis/config.d"
HOSTNAME_S = 2.0


@dataclass(frozen=True)
class ServedAddress:
    """Host and port of screen and API, more names by which they are asked, and the probe's serial number if known."""

    host: str = HOST
    port: int = PORT
    hosts: tuple[str, ...] = ()
    serial: str = ""

    @property
    def known_hosts(self) -> KnownHosts:
        """The names under which this machine may be asked."""
        return KnownHosts.of_machine(self.host, *self.hosts)

    @property
    def ways(self) -> list[str]:
        """How the probe is reached: by its host name and addresses, or from itself alone."""
        if self.host not in ANYWHERE:
            names = [self.host]
        else:
            names = [f"{socket.gethostname().partition('.')[0]}.local", *own_addresses()]
        return [f"http://{name}:{self.port}/" for name in names]


def read_address(root: Path = Path("/")) -> ServedAddress:
    """Return what the settings files below a root say, each over those before it."""
    server: dict[str, Any] = {}
    serial = ""
    for table in _tables(root):
        section = table.get("server")
        server |= section if isinstance(section, dict) else {}
        serial = table["serial"] if isinstance(table.get("serial"), str) else serial
    host, port, hosts = server.get("host"), server.get("port"), server.get("hosts")
    return ServedAddress(
        host if isinstance(host, str) and host else HOST,
        port if type(port) is int and 0 < port < 65536 else PORT,
        tuple(name for name in hosts if isinstance(name, str)) if isinstance(hosts, list) else (),
        serial,
    )


def own_addresses() -> list[str]:
    """Return the addresses of this machine that others can reach; the daemon serves IPv4."""
    try:
        done = subprocess.run(["hostname", "-I"], capture_output=True, text=True, timeout=HOSTNAME_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return []
    return [one for one in done.stdout.split() if ":" not in one]


def _tables(root: Path) -> Iterator[dict[str, Any]]:
    drop_ins = sorted((root / DROP_INS).glob("[!.]*.toml"))
    for path in [*(root / name for name in FILES), *drop_ins]:
        try:
            yield tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
