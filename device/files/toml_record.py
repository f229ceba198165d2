"""A TOML table to a record, a frozen dataclass: what is unknown, missing, of another type or out of range is refused.

A misspelt or mis-united key (`size_cm`) must never fall back to a default in silence, so all that is wrong is told by
its key. pydantic checks a table as strict JSON: a list is a tuple and a text a path, a whole number is a number, but no
text and no truth value is one, nor is inf. A TOML time counts as its text.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from datetime import date, time
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast, get_args, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from device.files.plain_settings import plain_table
from device.measurement.quantities import InvalidQuantity

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

Record = TypeVar("Record")

STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)
"""How every record is checked."""
UNKNOWN = "unexpected_keyword_argument"
"""pydantic's word for a key that a record does not have."""


class UnknownKey(InvalidQuantity):
    """A key that a record does not have."""


class InvalidRecord(InvalidQuantity):
    """Everything that is wrong in one record, a line each; `problems` has them one by one."""

    def __init__(self, problems: list[InvalidQuantity]) -> None:
        first = problems[0]
        super().__init__(first.quantity, first.value, first.bound, first.action)
        self.problems = problems
        self.args = ("\n".join(str(problem) for problem in problems),)

    def __reduce__(self) -> tuple[type[InvalidRecord], tuple[list[InvalidQuantity]]]:  # type: ignore[override]
        """Carry the error to another process with all its problems."""
        return type(self), (self.problems,)


def read_toml(kind: type[Record], path: Path) -> Record:
    """Return the record in a TOML file; raise `InvalidQuantity` naming the file, key or line that is wrong."""
    return from_table(kind, read_table(path))


def read_table(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds; raise `InvalidQuantity` when it cannot be read, or is no TOML."""
    try:
        return plain_table(path)
    except OSError as error:
        raise InvalidQuantity("file", path, "readable", f"give the path of a TOML file ({error.strerror})") from error
    except ValueError as error:
        raise InvalidQuantity("file", path, "valid TOML", f"correct it: {error}") from error


def from_table(kind: type[Record], table: Mapping[str, Any]) -> Record:
    """Return the record of a table; keys that are absent take its defaults. Raise `InvalidRecord` with all problems."""
    hashable: Any = kind  # as mypy does not believe of a class
    try:
        [record] = _checker(hashable).validate_json(json.dumps([table], default=_written_time))
    except ValidationError as error:
        raise InvalidRecord(list(_problems(kind, error))) from error
    return cast(Record, record)


def table_problems(kind: Any, table: Mapping[str, Any]) -> list[InvalidQuantity]:
    """Return all that is wrong with a table, in the order of the record; first of all the keys that it does not have.

    What a record itself refuses as a whole is told only when each of its values holds, and what is missing only where
    no misspelt key may stand for it.
    """
    try:
        from_table(kind, table)
    except InvalidRecord as error:
        return error.problems
    return []


def as_table(record: Any, *, without_none: bool = False) -> dict[str, Any]:
    """Return a record as the table that it can be read from; TOML has no None, there absence says it."""
    hashable: Any = type(record)
    [table] = _checker(hashable).dump_python([record], mode="json", exclude_none=without_none, warnings=False)
    return dict(table)


def annotation_parts(annotation: Any) -> Iterator[Any]:
    """Yield a type and all that it is made of: `X | None`, the items of a tuple, what `Annotated` adds to it."""
    yield annotation
    for part in get_args(annotation):
        yield from annotation_parts(part)


@cache
def _checker(kind: Any) -> TypeAdapter[list[Any]]:
    """Return what checks a list of records: pydantic takes no `STRICT` for a plain dataclass that stands alone."""
    return TypeAdapter(list[kind], config=STRICT)


def _written_time(moment: date | time) -> str:
    """Return what is no JSON, a date, a time or both, as TOML has it."""
    return moment.isoformat()


def _problems(kind: Any, refusal: ValidationError) -> Iterator[InvalidQuantity]:
    errors = refusal.errors(include_url=False)
    unknown = [error for error in errors if error["type"] == UNKNOWN]
    misspelt_in = {error["loc"][:-1] for error in unknown}
    for error in [*unknown, *(error for error in errors if error["type"] != UNKNOWN)]:
        told = error.get("ctx", {}).get("error")
        if isinstance(told, InvalidRecord):
            yield from told.problems
        elif isinstance(told, InvalidQuantity):
            yield told
        elif error["type"] != "missing" or error["loc"][:-1] not in misspelt_in:
            yield _problem(kind, error)


def _problem(kind: Any, error: ErrorDetails) -> InvalidQuantity:
    """Return pydantic's refusal as ours: key, value, what it must be, and what to do."""
    path, value, reason = error["loc"][1:], repr(error["input"]), error["type"]
    name = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).lstrip(".") or "file"
    if reason == UNKNOWN:
        *above, key = path
        known = _keys(kind, above)
        near = get_close_matches(str(key), known, n=1, cutoff=0.5)
        meant = f"did you mean {name.removesuffix(str(key))}{near[0]}" if near else "remove it"
        return UnknownKey(name, value, f"one of {', '.join(known)}", meant)
    if reason == "missing":
        return InvalidQuantity(name, "missing", "given", "add it")
    if reason == "dataclass_type":
        return InvalidQuantity(name, value, "a table", f"write it as [{name}]")
    if reason == "string_pattern_mismatch":
        wanted = _described(kind, path) or f"of the form {error['ctx']['pattern']}"
        return InvalidQuantity(name, value, wanted, "correct it")
    wanted = re.sub("^Input should be |^(Tuple|String) should have | after validation.*", "", error["msg"])
    return InvalidQuantity(name, value, wanted, "correct it")


def _keys(kind: Any, path: Iterable[str | int]) -> list[str]:
    """Return the keys that the table at a path may have."""
    return [field.name for field in fields(_table_at(kind, path))]


def _table_at(kind: Any, path: Iterable[str | int]) -> Any:
    for step in path:
        if isinstance(step, str):
            kind = next(part for part in annotation_parts(get_type_hints(kind)[step]) if is_dataclass(part))
    return kind


def _described(kind: Any, path: Sequence[str | int]) -> str | None:
    """Return in words what text must be like whose pattern is one of a key's annotations."""
    *above, key = [step for step in path if isinstance(step, str)]
    try:
        annotation = get_type_hints(_table_at(kind, above), include_extras=True)[key]
    except (KeyError, RuntimeError, StopIteration):  # the path leaves the records
        return None
    found = (part.description for part in annotation_parts(annotation) if isinstance(part, FieldInfo))
    return next((words for words in found if words), None)
