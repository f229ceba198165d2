"""Settings files for those who must not need the daemon's packages: where they lie, and what they plainly say.

The updater and the page that stands in for the daemon ask here, also when the settings are why no daemon starts, and
what darkens the LEDs, which has no time for packages (device/settings/plain_light.py). So nothing is checked against a
bound, and what cannot be read or used is passed over: the daemon itself then runs on its last good settings, and says
so. All checks: device/settings/layers.py. Standard library only.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

VENDOR, LOCAL, DROP_INS = "usr/lib/tsis/config.toml", "etc/tsis/config.toml", "etc/tsis/config.d"
"""Below the root, lowest first."""
ROOT = Path("/")
LAST_GOOD = "config.last_good.toml"
"""In the data folder: what the files set at the last start with all of them good (device/settings/last_good.py)."""
HOST, PORT, DATA = "127.0.0.1", 8000, "/var/lib/tsis"
"""What holds unless a file says otherwise."""
MIN_FREE_MB, MIN_FREE_BOUND_MB = 50.0, (1.0, 1e6)
"""The same of `store.min_free_mb`, and what it has to be within to be used, in 1e6 bytes."""


@dataclass(frozen=True)
class DaemonAddress:
    """The host and the port on which the daemon is to serve."""

    port: int = PORT
    host: str = HOST


def layer_files(root: Path = ROOT, stated: Path | None = None) -> list[Path]:
    """Return the settings files that there are, lowest first; `root` stands for / and `stated` has to be there."""
    installed = [path for path in (root / VENDOR, root / LOCAL) if is_there(path)]
    return [*installed, *_drop_ins(root / DROP_INS), *([stated] if stated else [])]


def is_there(path: Path) -> bool:
    """Return whether there is something to read, also when it may not be read: then reading says why."""
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError:
        return True
    return True


def _drop_ins(folder: Path) -> list[Path]:
    try:
        paths = sorted(folder.iterdir())
    except FileNotFoundError:
        return []
    except OSError:
        return [folder]  # reading it says why
    return [path for path in paths if path.suffix == ".toml" and not path.name.startswith(".")]


def plain_table(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds; raise `OSError` when it cannot be read, `ValueError` when it is no TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error


def plain_settings(root: Path) -> dict[str, Any]:
    """Return what the settings files below a root say, each over those before it; nothing of it is checked."""
    said: dict[str, Any] = {}
    for path in layer_files(root):
        try:
            table = plain_table(path)
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


def least_free_mb(root: Path) -> float:
    """Return how much space, in 1e6 bytes, the daemon needs on the disk of its data folder to take a press."""
    store = plain_settings(root).get("store")
    stated = store.get("min_free_mb") if isinstance(store, dict) else None
    low, high = MIN_FREE_BOUND_MB
    if isinstance(stated, int | float) and not isinstance(stated, bool) and low <= stated <= high:
        return float(stated)
    return MIN_FREE_MB


def below(root: Path, path: Path) -> Path:
    """Return a path as it is found below a root, as on a card that is mounted there; a relative one stays."""
    return root / path.relative_to("/") if path.is_absolute() else path


def as_booted(file: Path, root: Path) -> str:
    """Return where a file lies when the card below a root has started: there its own data folder says so."""
    place = file.resolve()
    root = root.resolve()
    return str("/" / place.relative_to(root)) if place.is_relative_to(root) else str(place)
