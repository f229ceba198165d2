"""One setting: a dataclass field that carries its unit, range and sentence, from which it is checked and documented.

A section checks each of its settings alone first, and what must fit together only when all of them hold alone. All that
is wrong is told at once, never only the first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from device.measurement.quantities import Bound, InvalidQuantity, require

ACTION = "correct the setting"


@dataclass(frozen=True)
class Setting:
    """What is known of a setting beside its name, type and default.

    `bound`: range, with the unit, of the number, or of each number of a list. `count`: numbers in the list.
    `choices`: all the words there are. `base`: 16 where it is written in hexadecimal.
    """

    sentence: str
    bound: Bound | None = None
    count: int | None = None
    choices: tuple[str, ...] = ()
    base: int = 10

    @property
    def unit(self) -> str:
        """Return the unit, empty for a ratio, a count of nothing, or words."""
        return self.bound.unit if self.bound else ""

    def problems(self, name: str, value: Any) -> Iterator[InvalidQuantity]:
        """Yield what keeps a value of the right type from being used; None is a setting that is not set."""
        if value is None:
            return
        if self.choices and value not in self.choices:
            yield InvalidQuantity(name, repr(value), f"one of {', '.join(self.choices)}", ACTION)
        if self.count and len(value) != self.count:
            yield InvalidQuantity(name, list(value), f"{self.count} numbers", ACTION)
        if self.bound:
            for number in value if self.count else (value,):
                try:
                    require(name, number, self.bound, ACTION)
                except InvalidQuantity as problem:
                    yield problem


def setting(default: Any, sentence: str, bound: Bound | None = None, **more: Any) -> Any:
    """Return a dataclass field with this default and, as its metadata, a `Setting`."""
    return field(default=default, metadata={"setting": Setting(sentence, bound, **more)})


class Conflict(InvalidQuantity):
    """A value that holds alone but not beside `others`, the full names of the settings it has to fit."""

    def __init__(self, quantity: str, value: object, bound: str, others: tuple[str, ...], action: str = "") -> None:
        super().__init__(quantity, value, bound, action or f"correct it or {' or '.join(others)}")
        self.others = others


def conflict(name: str, value: float, bound: Bound, *others: str) -> Iterator[Conflict]:
    """Yield a `Conflict` when a value lies outside the bound that the settings `others` leave it."""
    if not bound.holds(value):
        yield Conflict(name, value, str(bound), others)


class InvalidSettings(InvalidQuantity):
    """Everything that is wrong in one section, a line each; `problems` has them one by one."""

    def __init__(self, problems: list[InvalidQuantity]) -> None:
        first = problems[0]
        super().__init__(first.quantity, first.value, first.bound, first.action)
        self.problems = problems
        self.args = ("\n".join(str(problem) for problem in problems),)


class Section:
    """Base of a dataclass of settings; raises `InvalidSettings` when they do not hold."""

    prefix: ClassVar[str] = ""
    """What stands before each name: the section and a full stop."""

    def __post_init__(self) -> None:
        problems: list[InvalidQuantity] = [*self._alone()] or [*self.conflicts()]
        if problems:
            raise InvalidSettings(problems)

    def _alone(self) -> Iterator[InvalidQuantity]:
        for one in fields(self):  # type: ignore[arg-type]
            known = one.metadata.get("setting")
            if known:
                yield from known.problems(self.prefix + one.name, getattr(self, one.name))

    def conflicts(self) -> Iterator[Conflict]:
        """Yield what does not fit together of settings that hold alone."""
        yield from ()
