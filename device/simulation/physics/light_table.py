"""The light inside the probe's block as a table, so that no ray is traced on the device.

It holds one LED, at +x; the block's symmetry gives the other three. Per unit of LED light: the vector irradiance of the
sensing face at any depth of it, from the LED itself and from its image in the bottom, plus what walls and haze add.
Written by `host_tools optics build`. Source of the vector irradiance: Gershun, The Light Field, J. Math. Phys. 18
(1939), 51-151.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from device.files.table_file import load_table, save_table
from device.measurement.arrays import Single
from device.measurement.quantities import Bound, require

NAME, SCHEMA = "light_table", "tsis.light_table/1"
ACTION = "run `host_tools optics build` to make it again"
ARRAYS = ("depths_mm", "relative_irradiance", "half_angle", "stray", "background", "returned_ratio")

BLOCK_BOUNDS = {
    "half_width_mm": Bound(1.0, 200.0, "mm"),
    "thickness_mm": Bound(0.1, 100.0, "mm"),
    "refractive_index": Bound(1.0, 3.0, ""),
    "glass_refractive_index": Bound(1.0, 3.0, ""),
}
"""What the lookup needs to know of the block."""


@dataclass(frozen=True)
class LightTable:
    """Light of the LED at +x on n x n cells of the face, per unit of its light; `block` are the optics it holds for.

    `relative_irradiance` [2, 3, depths, n, n]: vector irradiance x, y, z of the LED and of its image in the bottom, at
    `depths_mm` of the face; 1 is the LED's light spread evenly over the face. `half_angle` [2, depths, n, n]: half the
    angle (rad) under which each is seen, measured upwards. `stray` [2, n, n]: light (1/mm2) from walls and haze into a
    wet and into a dry face. `background` [n, n]: radiance (1/(sr mm2)) of the haze itself. `returned_ratio` [2, 2]:
    share of the light given back by a wet or a dry skin that meets the face again, as taken in by a wet or a dry face;
    traced with the default skin's index, it hardly depends on it.
    """

    block: dict[str, float | str]
    depths_mm: Single
    relative_irradiance: NDArray[np.float16]
    half_angle: NDArray[np.float16]
    stray: Single
    background: Single
    returned_ratio: Single

    def number(self, name: str) -> float:
        """Return one number of the block's optics."""
        return float(self.block[name])

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write light_table.npz and light_table.json with the hash over both; `origin` says how it was made."""
        arrays = {name: getattr(self, name) for name in ARRAYS}
        record = {"schema": SCHEMA, "command": "host_tools optics build", "block": self.block, **origin}
        save_table(folder, NAME, arrays, record)


def load_light_table(folder: Path) -> LightTable:
    """Read a table; raise `InvalidQuantity` when it is missing, not what its record says, or of no possible block."""
    arrays, record = load_table(folder, NAME, SCHEMA, ARRAYS, ACTION)
    block = record.get("block")
    for name, bound in BLOCK_BOUNDS.items():
        value = block.get(name, "missing") if isinstance(block, dict) else "missing"
        require(f"light table's {name}", value, bound, ACTION)
    return LightTable(block=record["block"], **arrays)
