"""A TOML table to a frozen dataclass: unknown keys and wrong types are refused with the key and what was meant.

A misspelt or mis-united key (`size_cm`) must never fall back to a default in silence. Bounds are checked by the
dataclass itself.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from datetime import datetime
from difflib import get_close_matches
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from device.measurement.quantities import InvalidQuantity

Record = TypeVar("Record")

ACCEPTED: dict[Any, tuple[type, ...]] = {
    float: (int, float), int: (int,), str: (str,), bool: (bool,), Path: (str,), tuple: (list,),
    dict: (dict,), datetime: (datetime,),
}  # fmt: skip
"""What TOML must hold for a field of each type."""


def read_toml(kind: type[Record], path: Path) -> Record:
    """Return the record in a TOML file; raise `InvalidQuantity` naming the file, key or line that is wrong."""
    return from_table(kind, read_table(path))


def read_table(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds; raise `InvalidQuantity` when it cannot be read, or is no TOML."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidQuantity("file", path, "readable", f"give the path of a TOML file ({error.strerror})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InvalidQuantity("file", path, "valid TOML", f"correct it: {error}") from error


def table_problems(kind: Any, table: Mapping[str, Any], where: str = "") -> Iterator[InvalidQuantity]:
    """Yield each key of a table that the dataclass does not know, and each value of another type than its field."""
    types = get_type_hints(kind)
    known = [field.name for field in fields(kind)]
    for key, value in table.items():
        if key in known:
            yield from _value_problems(types[key], value, where + key)
            continue
        near = get_close_matches(key, known, n=1, cutoff=0.5)
        hint = f"did you mean {where}{near[0]}" if near else "remove it"
        yield InvalidQuantity(where + key, repr(value), f"one of {', '.join(known)}", hint)


def from_table(kind: type[Record], table: Mapping[str, Any], where: str = "") -> Record:
    """Return the record of a table; keys that are absent take the dataclass's defaults."""
    for problem in table_problems(kind, table, where):
        raise problem
    return _record(kind, table, where)


def _record(kind: type[Record], table: Mapping[str, Any], where: str) -> Record:
    types = get_type_hints(kind)
    values = {key: _value(types[key], value, where + key) for key, value in table.items()}
    try:
        return kind(**values)
    except TypeError as error:
        missing = str(error).rpartition(":")[2].strip()
        raise InvalidQuantity(where.rstrip(".") or "file", "incomplete", f"complete: {missing}", "add it") from error


def _stated(kind: Any) -> Any:
    """Return the X of `X | None`: TOML has no null, absence says None."""
    return next(part for part in get_args(kind) if part is not NoneType) if isinstance(kind, UnionType) else kind


def _value_problems(kind: Any, value: Any, where: str) -> Iterator[InvalidQuantity]:
    kind = _stated(kind)
    if is_dataclass(kind):
        if isinstance(value, Mapping):
            yield from table_problems(kind, value, where + ".")
        else:
            yield InvalidQuantity(where, repr(value), "a table", f"write it as [{where}]")
        return
    plain = get_origin(kind) or kind
    accepted = ACCEPTED.get(plain)
    if accepted and (not isinstance(value, accepted) or (isinstance(value, bool) and kind is not bool)):
        yield InvalidQuantity(where, repr(value), f"of type {accepted[-1].__name__}", "correct its type")
    elif plain is tuple:
        for i, item in enumerate(value):
            yield from _value_problems(get_args(kind)[0], item, f"{where}[{i}]")


def _value(kind: Any, value: Any, where: str) -> Any:
    kind = _stated(kind)
    if is_dataclass(kind) and isinstance(kind, type):
        return _record(kind, value, where + ".")
    plain = get_origin(kind) or kind
    if plain is tuple:
        return tuple(_value(get_args(kind)[0], item, f"{where}[{i}]") for i, item in enumerate(value))
    return plain(value) if plain is Path else value
