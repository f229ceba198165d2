"""All settings in the order of the sections: name, type, default and what is known of each."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

from typing_extensions import Doc

from device.config import HEXADECIMAL, Config
from device.files.toml_record import annotation_parts
from device.measurement.quantities import Bound


@dataclass(frozen=True)
class Known:
    """A setting with its full name, as `press.target_n`, its default, and its type with what is annotated to it."""

    name: str
    default: Any
    kind: Any

    @property
    def section(self) -> str:
        """Return the name of its section, empty for the settings above all sections."""
        return self.name.rpartition(".")[0]

    @property
    def sentence(self) -> str:
        """Return what it is, in a sentence."""
        return next(part.documentation for part in annotation_parts(self.kind) if isinstance(part, Doc))

    @property
    def bound(self) -> Bound | None:
        """Return the range of its number, or of each number of its list."""
        return next((part for part in annotation_parts(self.kind) if isinstance(part, Bound)), None)

    @property
    def unit(self) -> str:
        """Return the unit, empty for a ratio, a count of nothing, or words."""
        return self.bound.unit if self.bound else ""

    def value(self, config: Config) -> Any:
        """Return the value that a configuration gives it."""
        return attrgetter(self.name)(config)

    def written(self, value: Any) -> str:
        """Return a value as it is written in TOML; "not set" for None, which TOML cannot write."""
        if value is None:
            return "not set"
        if isinstance(value, tuple):
            return f"[{', '.join(self.written(one) for one in value)}]"
        if isinstance(value, str | Path):
            # JSON escapes as TOML does, but for DEL, which only TOML forbids.
            return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007f")
        if isinstance(value, bool):
            return str(value).lower()
        return f"{value:#04x}" if self._is_hexadecimal else str(value)

    @property
    def range(self) -> str:
        """Return the values it may have, in words; empty where every one of its type is taken."""
        parts, bound = [*annotation_parts(self.kind)], self.bound
        if bound is None:
            return ", ".join(word for part in parts if get_origin(part) is Literal for word in get_args(part))
        low, high = (f"{int(end):#04x}" if self._is_hexadecimal else f"{end:.10g}" for end in (bound.low, bound.high))
        each = "".join(f"{len(get_args(part))} numbers, " for part in parts if get_origin(part) is tuple)
        return f"{each}{low if bound.low_included else f'above {low}'} to {high}"

    @property
    def _is_hexadecimal(self) -> bool:
        return HEXADECIMAL in annotation_parts(self.kind)


def _known(kind: Any, prefix: str = "") -> Iterator[Known]:
    types = get_type_hints(kind, include_extras=True)
    for one in fields(kind):
        if is_dataclass(types[one.name]):
            yield from _known(types[one.name], f"{prefix}{one.name}.")
        else:
            yield Known(prefix + one.name, one.default, types[one.name])


SETTINGS = {known.name: known for known in _known(Config)}
"""Every setting of the daemon by its full name."""
