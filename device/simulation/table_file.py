"""A table of arrays on disk: NAME.npz beside NAME.json, which says what it is, how it was made, and its SHA-256.

A file that is missing, damaged or of another schema is refused; nothing is guessed.
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

from device.measurement.durable import write_durably
from device.measurement.quantities import InvalidQuantity

Array = NDArray[np.float64]


def save_table(folder: Path, name: str, arrays: Mapping[str, Array], record: Mapping[str, object]) -> None:
    """Write arrays (as float32) and their record with the hash; the record carries `schema` and `command`."""
    content = io.BytesIO()
    single: dict[str, Any] = {key: np.asarray(values, dtype=np.float32) for key, values in arrays.items()}
    np.savez_compressed(content, **single)
    described = {**record, "sha256": hashlib.sha256(content.getvalue()).hexdigest()}
    write_durably(folder / f"{name}.npz", content.getvalue())
    write_durably(folder / f"{name}.json", (json.dumps(described, indent=1) + "\n").encode())


def load_table(
    folder: Path, name: str, schema: str, keys: tuple[str, ...], action: str
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return the arrays of a table (as float64) and its record.

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
    digest = hashlib.sha256(content).hexdigest()
    if record.get("sha256") != digest:
        raise InvalidQuantity(f"{title}'s hash", digest[:12], f"{str(record.get('sha256'))[:12]} as stated", action)
    with np.load(io.BytesIO(content)) as stored:
        if missing := sorted(set(keys) - set(stored.files)):
            raise InvalidQuantity(f"{title}'s arrays", stored.files, f"with {', '.join(missing)}", action)
        return {key: stored[key].astype(np.float64) for key in keys}, record
