"""Settings files for those who must not need the daemon's packages: where they lie, and what they plainly say.

The updater and the page that stands in for the daemon ask here, also when the settings are why no daemon starts. So
nothing is checked against a bound, and what cannot be read or used is passed over: the daemon itself then runs on its
last good settings, and says so. All checks: device/settings/layers.py. Standard library only.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

VENDOR, LOCAL, DROP_INS = "usr/lib/tsis/config.toml", "etc/tsis/config.toml", "etc/tsis/config.d"
"""Below the root, lowest first."""
HOST, PORT, DATA = "127.0.0.1", 8000, "/var/lib/tsis"
"""What holds unless a file says otherwise."""


@dataclass(frozen=True)
class DaemonAddress:
    """The host and the port on which the daemon is to serve."""

    port: int = PORT
    host: str = HOST


def plain_settings(root: Path) -> dict[str, Any]:
    """Return what the settings files below a root say, each over those before it; nothing of it is checked."""
    said: dict[str, Any] = {}
    for path in (root / VENDOR, root / LOCAL, *sorted((root / DROP_INS).glob("[!.]*.toml"))):
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            continue
        for name, value in table.items():
            before = said.get(name)
            said[name] = before | value if isinstance(before, dict) and isinstance(value, dict) else value
    return said


def stated_server(root: Path) -> dict[str, Any]:
    """Return the section `server` of the files below a root."""
    server = plain_settings(root).get("server")
    return server if isinstance(server, dict) else {}


def daemon_address(root: Path) -> DaemonAddress:
    """Return where the daemon is to serve."""
    server = stated_server(root)
    host, port = server.get("host"), server.get("port")
    return DaemonAddress(
        port if type(port) is int and 0 < port < 65536 else PORT, host if isinstance(host, str) and host else HOST
    )


def data_folder(root: Path) -> Path:
    """Return the daemon's data folder, below the root."""
    data = plain_settings(root).get("data")
    folder = Path(data if isinstance(data, str) else DATA)
    return root / folder.relative_to(folder.anchor)
