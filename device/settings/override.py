"""A configuration with some settings of another one: those that a scene of the simulated probe states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from device.config import Config
from device.files.toml_record import table_problems
from device.settings.setting import Section

Settings = TypeVar("Settings", bound=Section)


def overridden(config: Config, table: Mapping[str, Any]) -> Config:
    """Return a configuration in which the settings of a table, as a settings file has them, stand for its own.

    Raises `InvalidQuantity` for a setting that is not known, of another type, out of its range, or that does not fit.
    """
    for problem in table_problems(Config, table):
        raise problem
    return _over(config, table)


def _over(section: Settings, table: Mapping[str, Any]) -> Settings:
    values = {name: _like(getattr(section, name), value) for name, value in table.items()}
    return replace(section, **values)  # type: ignore[type-var]


def _like(own: object, stated: Any) -> Any:
    """Return a value of a file as the configuration holds it: a section, a path, a tuple, or as it is."""
    if isinstance(own, Section):
        return _over(own, stated)
    if isinstance(own, Path):
        return Path(stated)
    return tuple(stated) if isinstance(stated, list) else stated
