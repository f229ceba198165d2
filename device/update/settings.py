"""The few settings of the daemon that an update needs, read without the daemon's packages.

A file that cannot be read is passed over: the daemon itself then runs on its last good settings, and says so.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.update.layout import UpdateLayout

FILES, DROP_INS = ("usr/lib/tsis/config.toml", "etc/tsis/config.toml"), "etc/tsis/config.d"
PORT, DATA, LOOPBACK = 8000, "/var/lib/tsis", "127.0.0.1"
ANYWHERE = ("", "0.0.0.0", "::")


@dataclass(frozen=True)
class DaemonAddress:
    """Where the daemon of this machine answers."""

    port: int = PORT
    host: str = LOOPBACK


def daemon_address(layout: UpdateLayout) -> DaemonAddress:
    """Return where the daemon answers: by loopback, unless it serves one other address only."""
    servers = [table.get("server", {}) for table in reversed(_tables(layout))]
    ports = (one.get("port") for one in servers)
    hosts = (one.get("host") for one in servers)
    port = next((port for port in ports if type(port) is int and port), PORT)
    host = next((host for host in hosts if isinstance(host, str)), LOOPBACK)
    return DaemonAddress(port, LOOPBACK if host in ANYWHERE else host)


def data_folder(layout: UpdateLayout) -> Path:
    """Return the daemon's data folder."""
    stated = [table.get("data") for table in _tables(layout)]
    named = next((data for data in reversed(stated) if isinstance(data, str)), DATA)
    return layout.inside(Path(named))


def _tables(layout: UpdateLayout) -> list[dict[str, Any]]:
    """Return what the settings files say, the last one above the others."""
    drop_ins = sorted((layout.root / DROP_INS).glob("[!.]*.toml"))
    tables = []
    for path in [*(layout.root / name for name in FILES), *drop_ins]:
        try:
            tables.append(tomllib.loads(path.read_text(encoding="utf-8")))
        except (OSError, ValueError):
            continue
    return [table for table in tables if isinstance(table.get("server", {}), dict)]
