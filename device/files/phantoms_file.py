"""What a recording needs of `phantoms.toml`: the phantom of a name, its inclusion and tissue, and its set's serial.

Tolerances, surfaces and what contradicts each other are the workstation's to check: `host_tools probe phantoms FILE`.
Source of the format: docs/own_probe.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.files.toml_record import read_table
from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, InvalidQuantity, require

CHECK = "run `host_tools probe phantoms` on the file, and correct it"
ABOVE_ZERO = Bound(0.0, 1e6, "", low_included=False)


@dataclass(frozen=True)
class KnownPhantom:
    """One phantom of a set: its inclusion, None in a bare block, and its tissue (kPa, mm)."""

    name: str
    set_serial: str
    inclusion: Inclusion | None
    tissue_modulus_kpa: float
    tissue_thickness_mm: float


def read_phantom(path: Path, name: str) -> KnownPhantom:
    """Return the phantom of a name; raise `InvalidQuantity` naming those of the file when it is not among them.

    Raises it, too, for a file that is no TOML of phantoms, or a number that is missing.
    """
    table = read_table(path)
    listed = table.get("phantoms")
    phantoms = [one for one in listed if isinstance(one, Mapping)] if isinstance(listed, list) else []
    found = [one for one in phantoms if one.get("name") == name]
    if not found:
        known = ", ".join(str(one.get("name")) for one in phantoms) or "none"
        raise InvalidQuantity("name", repr(name), f"a phantom of {path}: {known}", "name one of these")
    if len(found) > 1:
        raise InvalidQuantity("name", f"{name!r} {len(found)} times in {path}", "there once", CHECK)
    phantom, has_inclusion = found[0], any(one in found[0] for one in UNKNOWNS)
    return KnownPhantom(
        name,
        str(table.get("serial", "")),
        Inclusion(*(_number(phantom, key) for key in UNKNOWNS)) if has_inclusion else None,
        _number(phantom, "tissue_modulus_kpa"),
        _number(phantom, "tissue_thickness_mm"),
    )


def _number(phantom: Mapping[str, Any], key: str) -> float:
    value, quantity = phantom.get(key), f"{key} of {phantom['name']}"
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InvalidQuantity(quantity, "missing" if value is None else repr(value), "a number", CHECK)
    require(quantity, value, ABOVE_ZERO, CHECK)
    return float(value)
