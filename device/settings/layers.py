"""Settings files to one configuration: later files over earlier ones, each setting with the file that it comes from.

The built-in defaults lie below the vendor's file, that below /etc/tsis/config.toml, its drop-ins in the order of their
names, and the file that the command line states. A bad value is a problem also where a later file overrides it, and
nothing is used before every file holds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.config import RENAMED, Config, Conflict
from device.errors import ConfigError
from device.files.toml_record import as_table, from_table, read_table, table_problems
from device.measurement.quantities import InvalidQuantity
from device.settings.catalogue import SETTINGS


@dataclass(frozen=True)
class SettingProblem:
    """What is wrong with one setting, or with a whole file."""

    file: Path
    what: InvalidQuantity

    def __str__(self) -> str:
        return f"{self.file}: {self.what}"

    def as_record(self) -> dict[str, str]:
        """Return the problem as JSON object."""
        what = self.what
        return {
            "file": str(self.file),
            "setting": what.quantity,
            "value": str(what.value),
            "bound": what.bound,
            "hint": what.action,
        }


@dataclass(frozen=True)
class Layers:
    """What files set: `values` as in TOML and `origins` by the full names of the settings, or else `problems`.

    With problems there are still the values that hold alone. `renamed`: which settings are read by an old name.
    """

    files: tuple[Path, ...]
    values: Mapping[str, Any]
    origins: Mapping[str, Path]
    problems: tuple[SettingProblem, ...]
    renamed: tuple[str, ...] = ()

    def config(self) -> Config:
        """Return the configuration; raise `ConfigError` with every problem of every file."""
        if self.problems:
            raise self.refusal()
        return from_table(Config, _nested(self.values))

    def refusal(self, *more: SettingProblem) -> ConfigError:
        """Return the error that tells all problems of these files, and those beside them."""
        cause = "\n".join(str(problem) for problem in (*self.problems, *more))
        return ConfigError(cause, "Then start the daemon again.")


def read_config(path: Path) -> Config:
    """Return the configuration of one file over the defaults; raise `ConfigError` with all that is wrong in it."""
    return read_layers([path]).config()


def overridden(config: Config, table: Mapping[str, Any]) -> Config:
    """Return a configuration in which the settings of a table, as a settings file has them, stand for its own.

    Raises `InvalidQuantity` for a setting that is not known, of another type, out of its range, or that does not fit.
    """
    own = as_table(config)
    for name, stated in table.items():
        is_section = isinstance(stated, Mapping) and isinstance(own.get(name), dict)
        own[name] = own[name] | stated if is_section else stated
    return from_table(Config, own)


def read_layers(files: Iterable[Path]) -> Layers:
    """Return what these files set, each over those before it, and everything that is wrong with them."""
    read: list[Path] = []
    renamed: list[str] = []
    problems: list[SettingProblem] = []
    values: dict[str, Any] = {}
    origins: dict[str, Path] = {}
    for path in files:
        read.append(path)
        try:
            table = read_table(path)
        except InvalidQuantity as error:
            problems.append(SettingProblem(path, error))
            continue
        renamed += [f"{path}: {old} is called {RENAMED[old]} now: rename it" for old in _taken_over(table)]
        wrong = [_named_twice(what) for what in table_problems(Config, table) if not isinstance(what, Conflict)]
        problems += [SettingProblem(path, error) for error in wrong]
        held = {name: value for name, value in _flat(table) if name not in _names(wrong)}
        values |= held
        origins |= dict.fromkeys(held, path)
    refused = _names(problem.what for problem in problems)
    for conflict in _conflicts(_nested(values)):
        involved = (conflict.quantity, *conflict.others)
        if refused.isdisjoint(involved):
            file = next((origins[name] for name in involved if name in origins), read[-1])
            problems.append(SettingProblem(file, conflict))
    return Layers(tuple(read), values, origins, tuple(problems), tuple(renamed))


def _taken_over(table: dict[str, Any]) -> list[str]:
    """Give settings that have another name now that name, unless the table has both; return their old names.

    Else a release that renames one could start on no probe whose files were written before it.
    """
    old_names = [old for old, new in RENAMED.items() if old in table and new not in table]
    for old in old_names:
        table[RENAMED[old]] = table.pop(old)
    return old_names


def _named_twice(problem: InvalidQuantity) -> InvalidQuantity:
    """Return the problem of an old name beside the new one as that, any other as it is."""
    new = RENAMED.get(problem.quantity)
    if not new:
        return problem
    return InvalidQuantity(problem.quantity, problem.value, f"called {new} since this version", "remove the old name")


def _names(problems: Iterable[InvalidQuantity]) -> set[str]:
    """Return the settings that have problems; an item of a list is named by its number, as `light.ratio[2]`."""
    return {problem.quantity.partition("[")[0] for problem in problems}


def _conflicts(table: Mapping[str, Any]) -> list[Conflict]:
    """Return what does not fit together inside each section, then between those that hold."""
    found = _misfits(table)
    broken = {name for name, *others in map(_sections, found) if not others}
    if not broken:
        return found
    held = {name: part for name, part in table.items() if name not in broken}
    return found + [conflict for conflict in _misfits(held) if broken.isdisjoint(_sections(conflict))]


def _misfits(table: Mapping[str, Any]) -> list[Conflict]:
    """Return the conflicts of the sections, or, when there are none, those between them."""
    return [problem for problem in table_problems(Config, table) if isinstance(problem, Conflict)]


def _sections(conflict: Conflict) -> set[str]:
    return {name.partition(".")[0] for name in (conflict.quantity, *conflict.others)}


def _flat(table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the settings of a file by their full names, those that exist."""
    for key, value in table.items():
        entries = {f"{key}.{name}": one for name, one in value.items()} if isinstance(value, Mapping) else {key: value}
        yield from ((name, one) for name, one in entries.items() if name in SETTINGS)


def _nested(values: Mapping[str, Any]) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for name, value in values.items():
        section, _, key = name.rpartition(".")
        (table.setdefault(section, {}) if section else table)[key] = value
    return table
