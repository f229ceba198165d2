"""The decorator of every compiled function of the ray tracer: compiled once, not in every process.

Machine code is kept on disk, in a folder named by the hash of this room's sources: numba itself does not notice that a
called function in another file has changed, and a stale tracer would silently keep its old physics. So a compiled
function reads nothing of ours from outside this room. Source: numba's documentation, "Notes on caching".
"""

from __future__ import annotations

import os
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import TypeVar, cast

from numba import config, njit

from device.files.shipped import SOURCE_TREE

Function = TypeVar("Function", bound=Callable[..., object])
ROOM = Path(__file__).parent


def _kept_folder() -> Path | None:
    """Return the folder of these sources' machine code, made anew if need be; none where nothing can be written."""
    hashed = sha256()
    for source in sorted(ROOM.glob("*.py")):
        hashed.update(source.name.encode() + b"\0" + source.read_bytes() + b"\0")
    users = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "tsis")
    folder = (SOURCE_TREE / "build" if SOURCE_TREE else users) / "tracer" / hashed.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None


KEPT = _kept_folder()


def compiled(function: Function) -> Function:
    """Return the function, compiled at its first call ever for its types; strict floating point, one thread."""
    before, config.CACHE_DIR = config.CACHE_DIR, str(KEPT or "")
    try:
        return cast(Function, njit(cache=KEPT is not None)(function))
    finally:
        config.CACHE_DIR = before
