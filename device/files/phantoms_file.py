"""What a recording needs of `phantoms.toml`: the phantom of a name, its inclusion and tissue, and its set's serial.

Tolerances, surfaces and what contradicts each other are the workstation's to check: `host_tools probe phantoms FILE`.
Source of the format: docs/own_probe.md.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.files.toml_record import read_table
from device.measurement.parameters import RANGES
from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, InvalidQuantity, require, unit_of

CHECK = "run `host_tools probe phantoms` on the file, and correct it"
CORRECT = "look for a digit or a unit that is wrong, and correct the file: the recording keeps what it says"
PARAMETER_OF = {"tissue_thickness_mm": "slab_thickness_mm"}
"""What a parameter of a press is called where it is not as a phantom's file has it."""
NAME = re.compile(r"(?![.-])[^/\\\x00-\x1f\s]([^/\\\x00-\x1f]*[^/\\\x00-\x1f\s])?")
NOT_A_FOLDERS = (".zip", ".tmp")
"""How no folder of a recording ends: that of one file, and of what is half written."""


@dataclass(frozen=True)
class KnownPhantom:
    """One phantom of a set: its inclusion, None in a bare block, and its tissue (kPa, mm)."""

    name: str
    set_serial: str
    inclusion: Inclusion | None
    tissue_modulus_kpa: float
    tissue_thickness_mm: float


def recording_name_problem(quantity: str, name: str) -> InvalidQuantity | None:
    """Return why the file or folder of a recording cannot have a phantom's name, None where it can."""
    if NAME.fullmatch(name) and not name.lower().endswith(NOT_A_FOLDERS):
        return None
    bound = "a folder's name: without / and spaces at its ends, nor . or - first, nor .zip or .tmp last"
    return InvalidQuantity(quantity, repr(name), bound, "rename the phantom, and its recordings alike")


def read_phantom(path: Path, name: str) -> KnownPhantom:
    """Return the phantom of a name; raise `InvalidQuantity` naming those of the file when it is not among them.

    Raises it, too, for a file that is no TOML of phantoms, a name that no recording can have, or a number that is
    missing or beyond what the design's model was trained for: commissioning would refuse the recording.
    """
    if problem := recording_name_problem("name", name):
        raise problem
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
    trained = RANGES[PARAMETER_OF.get(key, key)]
    require(quantity, value, Bound(trained.low, trained.high, unit_of(key)), CORRECT)
    return float(value)
