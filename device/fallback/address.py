"""Where the daemon would be reached: the few settings of the server, read without the daemon's packages.

The settings may be why the daemon does not start, so what cannot be read or used is passed over.
"""

from __future__ import annotations

import socket
import subprocess
from dataclasses import dataclass
from pathlib import Path

from device.access.known_hosts import ANYWHERE, KnownHosts
from device.files.plain_settings import HOST, PORT, daemon_address, plain_settings, stated_server

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
    address, hosts, serial = daemon_address(root), stated_server(root).get("hosts"), plain_settings(root).get("serial")
    return ServedAddress(
        address.host,
        address.port,
        tuple(name for name in hosts if isinstance(name, str)) if isinstance(hosts, list) else (),
        serial if isinstance(serial, str) else "",
    )


def own_addresses() -> list[str]:
    """Return the addresses of this machine that others can reach; the daemon serves IPv4."""
    try:
        done = subprocess.run(["hostname", "-I"], capture_output=True, text=True, timeout=HOSTNAME_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return []
    return [one for one in done.stdout.split() if ":" not in one]
