"""Files of what somebody built or measured: numbers that are stated with a tolerance, `NAME` with `NAME_tolerance`.

A tolerance is one standard deviation, in the unit of its number. Everything that is wrong with a file is told at once:
keys and ranges by the record itself, and what contradicts each other among all numbers that hold alone.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_type_hints

import tomli_w

from device.files.toml_record import (
    InvalidRecord,
    Record,
    annotation_parts,
    as_table,
    from_table,
    read_table,
    table_problems,
)
from device.measurement.quantities import Bound, InvalidQuantity

SUFFIX = "_tolerance"
SIGMAS = 3.0
"""Two numbers that should be one differ by no more than this many standard deviations of their difference."""
Tolerance = Annotated[float, Bound(0.0, math.inf, "", low_included=False), "One standard deviation."]
"""Beside each number that varies from piece to piece or is known no better; nothing is known exactly."""
STATE = "state one standard deviation, as it was measured or as its data sheet says"
MEASURE = "state what was built or measured"


class StatedNumbers(dict[str, float]):
    """Numbers by their dotted names, `layers[0].thickness_mm`; one that is missing or refused is NaN: it tells nothing.

    No comparison with NaN is true, so what is written as "too large" or "too small" keeps silent about such.
    """

    def __missing__(self, name: str) -> float:
        return math.nan

    def without(self, names: Iterable[str]) -> StatedNumbers:
        """Return all but these."""
        left_out = set(names)
        return StatedNumbers({name: value for name, value in self.items() if name not in left_out})

    def tolerance(self, name: str) -> float:
        """Return the tolerance of a number; 0 where it is not known."""
        return max(0.0, self.get(name + SUFFIX, 0.0))


class Declared(NamedTuple):
    """One key that a record declares: dotted name without numbers of a list, range, and what it means."""

    name: str
    bound: Bound | None
    meaning: str

    @property
    def is_above_zero(self) -> bool:
        """Whether it is a number that cannot be 0, so that a tolerance beyond it means nothing."""
        return self.bound is not None and not self.bound.holds(0.0) and self.bound.low >= 0


Misfits = Callable[[StatedNumbers, Mapping[str, Any]], Iterator[InvalidQuantity]]
"""What contradicts each other in a file: of its numbers that hold alone, and of its whole table, unchecked."""


def declared(kind: Any, above: str = "") -> Iterator[Declared]:
    """Yield what a record of records declares, in its order."""
    for name, annotation in get_type_hints(kind, include_extras=True).items():
        inner = _record_in(annotation)
        if inner is not None:
            yield from declared(inner, f"{above}{name}.")
            continue
        bound = next((part for part in annotation_parts(annotation) if isinstance(part, Bound)), None)
        yield Declared(f"{above}{name}", bound, _meaning(annotation))


def _record_in(annotation: Any) -> Any:
    """Return the record that an annotation is made of, or None."""
    return next((part for part in annotation_parts(annotation) if isinstance(part, type) and is_dataclass(part)), None)


def _meaning(annotation: Any) -> str:
    return next((part for part in getattr(annotation, "__metadata__", ()) if isinstance(part, str)), "")


def declared_name(name: str) -> str:
    """Return the name under which a number is declared: that without the places in lists."""
    return re.sub(r"\[\d+\]", "", name)


def numbers_of(table: Any, name: str = "") -> StatedNumbers:
    """Return every finite number of a table, by its dotted name."""
    if isinstance(table, Mapping):
        items = [(f"{name}.{key}".lstrip("."), value) for key, value in table.items()]
    elif isinstance(table, list | tuple):
        items = [(f"{name}[{place}]", value) for place, value in enumerate(table)]
    else:
        is_number = isinstance(table, int | float) and not isinstance(table, bool)
        return StatedNumbers({name: float(table)} if is_number and math.isfinite(table) else {})
    return StatedNumbers({key: value for path, item in items for key, value in numbers_of(item, path).items()})


def oversized_tolerances(kind: Any, numbers: StatedNumbers) -> Iterator[InvalidQuantity]:
    """Yield every tolerance that is as large as its number, of those that cannot be 0."""
    above_zero = {one.name for one in declared(kind) if one.is_above_zero}
    for name, value in numbers.items():
        stated = name.removesuffix(SUFFIX)
        if stated != name and declared_name(stated) in above_zero and value >= numbers[stated]:
            yield InvalidQuantity(name, f"{value:g}", f"below {stated} of {numbers[stated]:g}", STATE)


def read_stated(kind: type[Record], path: Path, misfits: Misfits) -> Record:
    """Return the record of a TOML file; raise `InvalidRecord` with all that is wrong in it."""
    table = read_table(path)
    if problems := stated_problems(kind, table, misfits):
        raise InvalidRecord(problems)
    return from_table(kind, table)


def stated_problems(kind: Any, table: Mapping[str, Any], misfits: Misfits) -> list[InvalidQuantity]:
    """Return all that is wrong with a table: of single keys first, then among the numbers that hold alone."""
    found = [_with_action(problem) for problem in _key_problems(kind, table)]
    holding = numbers_of(table).without(problem.quantity for problem in found)
    known = {str(problem) for problem in found}
    together = [*oversized_tolerances(kind, holding), *misfits(holding, table)]
    return found + [one for one in together if str(one) not in known]


def _key_problems(kind: Any, table: Mapping[str, Any]) -> list[InvalidQuantity]:
    """Return what is wrong with single keys, also what is missing beside a misspelt key that does not stand for it."""
    found = table_problems(kind, table)
    unknown = [problem for problem in found if problem.action.startswith(("did you mean ", "remove it"))]
    meant = {problem.action.removeprefix("did you mean ") for problem in unknown}
    if not unknown:
        return found
    rest = table_problems(kind, _without(table, {problem.quantity for problem in unknown}))
    known = {str(problem) for problem in found}
    return found + [one for one in rest if one.quantity not in meant and str(one) not in known]


def _without(table: Any, names: set[str], above: str = "") -> Any:
    """Return a table without the keys of these dotted names."""
    if isinstance(table, Mapping):
        dotted = ((f"{above}.{key}".lstrip("."), key, value) for key, value in table.items())
        return {key: _without(value, names, name) for name, key, value in dotted if name not in names}
    if isinstance(table, list):
        return [_without(item, names, f"{above}[{place}]") for place, item in enumerate(table)]
    return table


def require_fitting(record: Any, misfits: Misfits) -> None:
    """Raise `InvalidRecord` with all that contradicts each other in a record whose values hold alone."""
    table = as_table(record)
    numbers = numbers_of(table)
    if problems := [*oversized_tolerances(type(record), numbers), *misfits(numbers, table)]:
        raise InvalidRecord(problems)


def _with_action(problem: InvalidQuantity) -> InvalidQuantity:
    """Return a refusal by key and range with what to do about it."""
    if problem.action not in ("correct it", "add it"):
        return problem
    action = STATE if problem.quantity.endswith(SUFFIX) else MEASURE
    return InvalidQuantity(problem.quantity, problem.value, problem.bound, action)


class StatedRow(NamedTuple):
    """One key of a record to be shown: name, value and tolerance as text, unit."""

    name: str
    value: str
    tolerance: str
    unit: str


def stated_rows(record: Any) -> Iterator[StatedRow]:
    """Yield every key of a record with its tolerance beside it; "" where it has none or no unit."""
    said, table = {one.name: one for one in declared(type(record))}, as_table(record)
    values = dict(_values(table))
    for name, value in values.items():
        if not name.endswith(SUFFIX):
            bound, tolerance = said[declared_name(name)].bound, values.get(name + SUFFIX)
            text = "" if tolerance is None else f"{tolerance:g}"
            yield StatedRow(name, _shown(value), text, bound.unit if bound else "")


def _values(table: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of a table of tables by their dotted names; a list of plain values is one."""
    if isinstance(table, Mapping):
        for key, value in table.items():
            yield from _values(value, f"{name}.{key}".lstrip("."))
    elif isinstance(table, list) and table and isinstance(table[0], Mapping):
        for place, value in enumerate(table):
            yield from _values(value, f"{name}[{place}]")
    elif table is not None:
        yield name, table


def _shown(value: Any) -> str:
    if isinstance(value, list):
        return ", ".join(map(_shown, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def as_commented(kind: Any, table: Mapping[str, Any]) -> str:
    """Return a table of sections as TOML, with a comment on each key; one that is missing is left to be filled in."""
    hints, lines, sections = get_type_hints(kind), list[str](), list[str]()
    for one in declared(kind):
        if "." not in one.name:
            lines.append(_commented_key(one, table))
    for field in fields(kind):
        if inner := _record_in(hints[field.name]):
            items = table[field.name]
            title, items = (f"[[{field.name}]]", items) if isinstance(items, list) else (f"[{field.name}]", [items])
            sections += [f"{title}\n{as_commented(inner, item)}" for item in items]
    return "\n".join(["".join(lines), *sections])


def _commented_key(one: Declared, table: Mapping[str, Any]) -> str:
    if one.name not in table:
        return f"# {one.name} = ?\n"
    comment = "" if one.name.endswith(SUFFIX) else f"# {one.meaning}\n"
    return comment + tomli_w.dumps({one.name: table[one.name]})
