"""A table of arrays on disk: NAME.npz beside NAME.json, which says what it is, how it was made, and the hash of both.

A file that is missing, damaged, of another schema, or whose record was changed is refused; nothing is guessed.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.files.durable import write_durably
from device.measurement.quantities import InvalidQuantity

STORED_AS = {"elastic_mismatch": "contrast"}
"""Arrays that the committed files know by an older name."""


def save_table(folder: Path, name: str, arrays: Mapping[str, NDArray[Any]], record: Mapping[str, object]) -> None:
    """Write arrays and their record, which carries `schema` and `command`, with the hash over both."""
    content = io.BytesIO()
    named: dict[str, Any] = {_stored(key): array for key, array in arrays.items()}
    np.savez_compressed(content, **named)
    described = {**record, "sha256": _digest(content.getvalue(), record)}
    write_durably(folder / f"{name}.npz", content.getvalue())
    write_durably(folder / f"{name}.json", (json.dumps(described, indent=1) + "\n").encode())


def load_table(
    folder: Path, name: str, schema: str, keys: tuple[str, ...], action: str
) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return the arrays of a table and its record.

    Raises `InvalidQuantity` when it is missing, of another schema, or its hash or arrays are not as stated.
    """
    title = name.replace("_", " ")
    try:
        record = json.loads((folder / f"{name}.json").read_text(encoding="utf-8"))
        content = (folder / f"{name}.npz").read_bytes()
    except (OSError, ValueError) as error:
        raise InvalidQuantity(title, folder, "readable", action) from error
    found = record.get("schema") if isinstance(record, dict) else None
    if found != schema:
        raise InvalidQuantity(f"{title}'s schema", found, schema, action)
    digest = _digest(content, record)
    if record.get("sha256") != digest:
        raise InvalidQuantity(f"{title}'s hash", digest[:12], f"{str(record.get('sha256'))[:12]} as stated", action)
    with np.load(io.BytesIO(content)) as stored:
        if missing := sorted(set(map(_stored, keys)) - set(stored.files)):
            raise InvalidQuantity(f"{title}'s arrays", stored.files, f"with {', '.join(missing)}", action)
        return {key: stored[_stored(key)] for key in keys}, record


def _stored(key: str) -> str:
    return STORED_AS.get(key, key)


def _digest(content: bytes, record: Mapping[str, object]) -> str:
    """Return the hash of the arrays and of what is said of them: neither can be changed alone."""
    said = {key: value for key, value in record.items() if key != "sha256"}
    return hashlib.sha256(content + json.dumps(said, sort_keys=True).encode()).hexdigest()
