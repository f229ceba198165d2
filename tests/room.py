"""Prints the tests of one module's room: those of the folder under tests/ that mirrors its own, its own file first.

`python tests/room.py device/web/app.py` prints `tests/device/web`; a file of tests is its own room. For `make loop`.
"""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def room(file: str) -> list[str]:
    """Return the paths, from the root of the repository, of the tests of a module's room.

    A room without tests of its own is tested with that above it; what lies in a package's root, by its own file alone
    if there is one. Raises `ValueError` for a file that is none of ours.
    """
    path = (ROOT / file).resolve()
    if not path.is_file() or not path.is_relative_to(ROOT) or path.suffix != ".py":
        raise ValueError(f"FILE is {file!r}, but must be a module of this repository: say FILE=device/web/app.py")
    inside = path.relative_to(ROOT)
    if inside.parts[0] == "tests":
        return [str(inside)]
    folder = ROOT / "tests" / inside.parent
    while not any(folder.glob("test_*.py")):
        folder = folder.parent
    own = ROOT / "tests" / inside.parent / f"test_{inside.name}"
    if len(inside.parts) == 2:
        found = [own] if own.is_file() else sorted(folder.glob("test_*.py"))
    else:
        found = [own, folder] if own.is_file() else [folder]
    return [str(one.relative_to(ROOT)) for one in found]


if __name__ == "__main__":
    try:
        print(*room(sys.argv[1] if len(sys.argv) > 1 else ""))
    except ValueError as error:
        sys.exit(str(error))
