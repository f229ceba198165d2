"""The virtual probe's mechanics: a table of deformed surfaces, so that no finite elements run on the device.

For every (size, depth, Young's modulus) of the paper's box it gives the surface deformation w(r) for 1 N: the lump-free
one, and the lump field to be added. Interpolated by Chebyshev polynomials in size, depth and ln E. Small strain, so
everything is proportional to the force. Written by `host_tools table`. Source: Trefethen, Approximation Theory and
Approximation Practice, chapter 5 (barycentric interpolation).
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
from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, InvalidQuantity, require

Array = NDArray[np.float64]
SCHEMA = "tsis.surface_table/1"


def chebyshev_points(low: float, high: float, count: int) -> Array:
    """Return ascending Chebyshev points of the second kind, both ends included."""
    return np.asarray((low + high) / 2 - (high - low) / 2 * np.cos(np.pi * np.arange(count) / (count - 1)))


def barycentric_weights(points: Array, at: float) -> Array:
    """Return the weights [n] that interpolate values at Chebyshev points of the second kind."""
    distance = at - points
    hit = np.flatnonzero(np.abs(distance) < 1e-12 * np.ptp(points))
    if len(hit):
        return np.asarray(np.eye(len(points))[hit[0]])
    weight = (-1.0) ** np.arange(len(points))
    weight[[0, -1]] /= 2
    terms = weight / distance
    return np.asarray(terms / terms.sum())


@dataclass(frozen=True)
class SurfaceTable:
    """Surfaces for 1 N: `w_mm_per_n` [r], `lump_mm_per_n` [size, depth, modulus, r], at radii `r_mm`."""

    size_mm: Array
    depth_mm: Array
    youngs_modulus_kpa: Array
    r_mm: Array
    w_mm_per_n: Array
    lump_mm_per_n: Array

    def lump(self, inclusion: Inclusion) -> Array:
        """Return the lump field for 1 N at `r_mm`; refuses an inclusion outside the table."""
        field = self.lump_mm_per_n
        for name in UNKNOWNS:
            points: Array = getattr(self, name)
            value = getattr(inclusion, name)
            unit = "kPa" if name.endswith("_kpa") else "mm"
            require(name, value, Bound(points[0], points[-1], unit), "choose an inclusion inside the table's range")
            if name == "youngs_modulus_kpa":
                points, value = np.log(points), np.log(value)
            field = np.tensordot(barycentric_weights(points, value), field, 1)
        return field

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write surface_table.npz and its description with the hash."""
        arrays = {name: getattr(self, name).astype(np.float32) for name in self.__dataclass_fields__}
        content = io.BytesIO()
        np.savez(content, **arrays)
        digest = hashlib.sha256(content.getvalue()).hexdigest()
        record = {"schema": SCHEMA, "sha256": digest, "command": "host_tools table", **origin}
        write_durably(folder / "surface_table.npz", content.getvalue())
        write_durably(folder / "surface_table.json", (json.dumps(record, indent=1) + "\n").encode())


def load_surface_table(folder: Path) -> SurfaceTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    action = "run `host_tools table` to make it again"
    try:
        record = json.loads((folder / "surface_table.json").read_text(encoding="utf-8"))
        content = (folder / "surface_table.npz").read_bytes()
    except (OSError, ValueError) as error:
        raise InvalidQuantity("surface table", folder, "readable", action) from error
    schema = record.get("schema") if isinstance(record, dict) else None
    if schema != SCHEMA:
        raise InvalidQuantity("surface table's schema", schema, SCHEMA, action)
    digest = hashlib.sha256(content).hexdigest()
    if record.get("sha256") != digest:
        raise InvalidQuantity(
            "surface table's hash", digest[:12], f"{str(record.get('sha256'))[:12]} as stated", action
        )
    with np.load(folder / "surface_table.npz") as arrays:
        axes = {name: arrays[name].astype(np.float64) for name in SurfaceTable.__dataclass_fields__}
    return SurfaceTable(**axes)
