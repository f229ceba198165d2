"""The light inside the probe's block as a table, so that no ray is traced on the device.

It holds one LED, at +x; the block's symmetry gives the other three. Per unit of LED light: the vector irradiance of the
sensing face at any depth of it, from the LED itself and from its image in the bottom, plus what walls and haze add.
Written by `host_tools optics build`. Source of the vector irradiance: Gershun, The Light Field, J. Math. Phys. 18
(1939), 51-151.
"""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from device.measurement.durable import write_durably
from device.measurement.quantities import InvalidQuantity

Array = NDArray[np.float32]
SCHEMA = "tsis.light_table/1"
ACTION = "run `host_tools optics build` to make it again"
ARRAYS = ("depths_mm", "relative_irradiance", "half_angle", "stray", "background", "returned_ratio")


@dataclass(frozen=True)
class LightTable:
    """Light of the LED at +x on n x n cells of the face, per unit of its light; `block` are the optics it holds for.

    `relative_irradiance` [2, 3, depths, n, n]: vector irradiance x, y, z of the LED and of its image in the bottom, at
    `depths_mm` of the face; 1 is the LED's light spread evenly over the face. `half_angle` [2, depths, n, n]: half the
    angle (rad) under which each is seen, measured upwards. `stray` [2, n, n]: light (1/mm2) from walls and haze into a
    wet and into a dry face. `background` [n, n]: radiance (1/(sr mm2)) of the haze itself. `returned_ratio` [2, 2]:
    share of the light given back by a wet or a dry skin that meets the face again, as taken in by a wet or a dry face.
    """

    block: dict[str, float | str]
    depths_mm: Array
    relative_irradiance: NDArray[np.float16]
    half_angle: NDArray[np.float16]
    stray: Array
    background: Array
    returned_ratio: Array

    def number(self, name: str) -> float:
        """Return one number of the block's optics."""
        return float(self.block[name])

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write light_table.npz and light_table.json with the hash over both; `origin` says how it was made."""
        content = io.BytesIO()
        np.savez_compressed(content, **{name: getattr(self, name) for name in ARRAYS})
        digest = _digest(content.getvalue(), self.block)
        record = {
            "schema": SCHEMA,
            "sha256": digest,
            "command": "host_tools optics build",
            "block": self.block,
            **origin,
        }
        write_durably(folder / "light_table.npz", content.getvalue())
        write_durably(folder / "light_table.json", (json.dumps(record, indent=1) + "\n").encode())


def _digest(content: bytes, block: object) -> str:
    """Return the hash of the arrays and of the optics they hold for: neither can be changed alone."""
    return hashlib.sha256(content + json.dumps(block, sort_keys=True).encode()).hexdigest()


def load_light_table(folder: Path) -> LightTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    try:
        record = json.loads((folder / "light_table.json").read_text(encoding="utf-8"))
        content = (folder / "light_table.npz").read_bytes()
    except (OSError, ValueError) as error:
        raise InvalidQuantity("light table", folder, "readable", ACTION) from error
    schema = record.get("schema") if isinstance(record, dict) else None
    if schema != SCHEMA:
        raise InvalidQuantity("light table's schema", schema, SCHEMA, ACTION)
    digest = _digest(content, record.get("block"))
    if record.get("sha256") != digest:
        raise InvalidQuantity("light table's hash", digest[:12], f"{str(record.get('sha256'))[:12]} as stated", ACTION)
    with np.load(io.BytesIO(content)) as arrays:
        return LightTable(block=record["block"], **{name: arrays[name] for name in ARRAYS})
