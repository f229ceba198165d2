"""`probe.toml`: a probe to a commented file and back; the simulated probe's own, and one to fill in for a new probe."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from device.files.durable import write_durably
from device.files.shipped import SIMULATED_PROBE
from device.files.toml_record import as_table, from_table
from device.measurement.quantities import InvalidQuantity
from host_tools.scenes.probe import Probe, misfits
from host_tools.scenes.stated import SUFFIX, as_commented, read_stated

NAME = "probe.toml"
HEADER = """\
# What the builder of a probe knows of it. `NAME_tolerance` is one standard deviation, in the unit of NAME:
# how much the number may vary, or how well it was measured. The first of the layers faces the tissue.
# `host_tools probe check` names everything that is wrong in this file.
"""
TO_FILL_IN = """\
# Numbers without a tolerance are the design of docs/build.md: replace what was measured.
# Every line that ends with "= ?" is to be filled in, without the "#" before it.
"""


def read_probe(path: Path) -> Probe:
    """Return the probe of a file; raise `InvalidRecord` with everything that is wrong in it."""
    return read_stated(Probe, path, misfits)


@cache
def simulated_probe() -> Probe:
    """Return the simulated probe, whose numbers are the defaults of the code."""
    return read_probe(SIMULATED_PROBE / NAME)


def probe_of(path: Path | None) -> Probe:
    """Return the probe of a file, or the simulated one where none is given."""
    return read_probe(path) if path else simulated_probe()


def probe_text(probe: Probe) -> str:
    """Return a probe's file, with a comment on each key."""
    return f"{HEADER}\n{as_commented(Probe, as_table(probe))}"


def write_new_probe(path: Path, serial: str | None) -> None:
    """Write a file of the design, in which every tolerance is to be filled in; raise where it exists already."""
    table = _without_tolerances(as_table(simulated_probe()))
    del table["serial"]
    if path.exists():
        raise InvalidQuantity("file", path, "a new file", "give another name: what is in this one would be lost")
    named = {"serial": serial, **table} if serial else table
    write_durably(path, f"{HEADER}{TO_FILL_IN}\n{as_commented(Probe, named)}".encode())


def write_camera(path: Path, measured: Mapping[str, float]) -> Probe:
    """Write measured keys of `[camera]` into a probe's file, whose other lines stay as they are; return the probe.

    Raises `InvalidRecord` before anything is written when the file, or the probe with these, does not hold.
    """
    found, text = read_probe(path), path.read_text(encoding="utf-8")
    table = as_table(found)
    changed = from_table(Probe, table | {"camera": table["camera"] | measured})
    before, section, rest = text.partition("\n[camera]\n")
    for key, value in measured.items():
        rest = re.sub(
            rf"^{key}[ \t]*=[^#\n]*?(?=[ \t]*(#.*)?$)", f"{key} = {value!r}", rest, count=1, flags=re.MULTILINE
        )
    edited = before + section + rest
    if from_table(Probe, tomllib.loads(edited)) != changed:  # written in a way of its own: all of it anew
        edited = probe_text(changed)
    write_durably(path, edited.encode())
    return changed


def _without_tolerances(table: Any) -> Any:
    if isinstance(table, dict):
        return {key: _without_tolerances(value) for key, value in table.items() if not key.endswith(SUFFIX)}
    return [_without_tolerances(item) for item in table] if isinstance(table, list) else table
