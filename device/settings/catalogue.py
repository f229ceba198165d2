"""All settings in the order of the sections: name, type, default and what is known of each."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, fields, is_dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any, get_type_hints

from device.config import Config
from device.settings.setting import Setting


@dataclass(frozen=True)
class Known:
    """A setting with its full name, as `press.target_n`, and its default."""

    name: str
    default: Any
    setting: Setting

    @property
    def section(self) -> str:
        """Return the name of its section, empty for the settings above all sections."""
        return self.name.rpartition(".")[0]

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
        return f"{value:#04x}" if self.setting.base == 16 else str(value)

    @property
    def range(self) -> str:
        """Return the values it may have, in words; empty where every one of its type is taken."""
        bound = self.setting.bound
        if bound is None:
            return ", ".join(self.setting.choices)
        low, high = (
            f"{int(end):#04x}" if self.setting.base == 16 else f"{end:.10g}" for end in (bound.low, bound.high)
        )
        each = f"{self.setting.count} numbers, " if self.setting.count else ""
        return f"{each}{low if bound.low_included else f'above {low}'} to {high}"


def _known(kind: type, prefix: str = "") -> Iterator[Known]:
    types = get_type_hints(kind)
    for one in fields(kind):
        if is_dataclass(types[one.name]):
            yield from _known(types[one.name], f"{prefix}{one.name}.")
        else:
            yield Known(prefix + one.name, one.default, one.metadata["setting"])


SETTINGS = {known.name: known for known in _known(Config)}
"""Every setting of the daemon by its full name."""
