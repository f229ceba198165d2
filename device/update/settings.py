"""The few settings of the daemon that an update needs, read without the daemon's packages.

A file that cannot be read is passed over: the daemon itself then runs on its last good settings, and says so.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from device.update.layout import UpdateLayout

FILES, DROP_INS = ("usr/lib/tsis/config.toml", "etc/tsis/config.toml"), "etc/tsis/config.d"
PORT, DATA = 8000, "/var/lib/tsis"


def daemon_port(layout: UpdateLayout) -> int:
    """Return the port on which the daemon answers."""
    stated = [table.get("server", {}).get("port") for table in _tables(layout)]
    return next((port for port in reversed(stated) if type(port) is int and port), PORT)


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
