"""What a release held when it was written: a list of hashes in it, by which anybody can tell that it is still whole.

The list has the form of `sha256sum`, so that `sha256sum --check contents.sha256` says the same without this code.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

CONTENTS, INTERPRETER_LINK = "contents.sha256", "bin/python"


def write_contents(folder: Path) -> None:
    """Write the list of all files of a release into it. Raises `OSError`."""
    lines = [f"{digest}  {name}\n" for name, digest in sorted(_hashes(folder).items())]
    (folder / CONTENTS).write_text("".join(lines), encoding="utf-8")


def damage(folder: Path) -> list[str]:
    """Return what of a release is missing, changed or too much; nothing of a whole one."""
    try:
        lines = (folder / CONTENTS).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        return [f"{CONTENTS} cannot be read: {error}"]
    listed = {name: digest for digest, _, name in (line.partition("  ") for line in lines)}
    if not listed:
        return [f"{CONTENTS} is empty"]
    found = _hashes(folder)
    problems = [] if (folder / INTERPRETER_LINK).is_symlink() else [f"{INTERPRETER_LINK} is missing"]
    problems += [f"{name} is missing" for name in sorted(listed.keys() - found.keys())]
    problems += [f"{name} is not listed" for name in sorted(found.keys() - listed.keys())]
    changed = [name for name in sorted(listed) if found.get(name, listed[name]) != listed[name]]
    return problems + [f"{name} has changed" for name in changed]


def _hashes(folder: Path) -> dict[str, str]:
    """Return the hash of every file's content by its path in the folder; links have none."""
    found: dict[str, str] = {}
    for place, _, names in os.walk(folder):
        for name in names:
            path = Path(place, name)
            if not path.is_symlink():
                found[str(path.relative_to(folder))] = hashlib.sha256(path.read_bytes()).hexdigest()
    found.pop(CONTENTS, None)
    return found
