"""Points of cost and error, and which of them nobody would choose.

A point is on the Pareto front when no other is as good in both and better in one. Times repeat to some 10 %, so a
point is called needless only when another beats it by that margin.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from device.measurement.quantities import Bound, require

MARGIN = 1.1
"""A cost or an error this many times as large is larger, whatever the noise."""


@dataclass(frozen=True)
class Choice:
    """One way to do a thing: its name, the family it belongs to, its cost and its error, both above 0.

    `chosen` is the one that the software takes.
    """

    name: str
    family: str
    cost: float
    error: float
    chosen: bool = False

    def __post_init__(self) -> None:
        for name in ("cost", "error"):
            what = f"{name} of {self.name}"
            require(what, getattr(self, name), Bound(0.0, 1e30, ""), "measure it again")


def front(choices: Iterable[Choice]) -> list[Choice]:
    """Return the choices that no other one dominates, by rising cost; of equal ones the first."""
    best: list[Choice] = []
    for choice in sorted(choices, key=lambda one: (one.cost, one.error)):
        if not best or choice.error < best[-1].error:
            best.append(choice)
    return best


def beats(one: Choice, other: Choice, margin: float = MARGIN) -> bool:
    """Return whether one is no worse than the other in both, and better by the margin in one."""
    no_worse = one.cost <= other.cost and one.error <= other.error
    return no_worse and (one.cost * margin <= other.cost or one.error * margin <= other.error)


def needless(choices: Sequence[Choice], margin: float = MARGIN) -> list[Choice]:
    """Return the choices that another one beats."""
    return [choice for choice in choices if any(beats(other, choice, margin) for other in choices)]


def needless_everywhere(panels: Sequence[Sequence[Choice]], margin: float = MARGIN) -> list[str]:
    """Return the names of choices that are beaten in every panel in which they stand, in the order of appearance."""
    beaten = [{one.name for one in needless(panel, margin)} for panel in panels]
    names = dict.fromkeys(one.name for panel in panels for one in panel)

    def everywhere(name: str) -> bool:
        within = [found for panel, found in zip(panels, beaten, strict=True) if name in {one.name for one in panel}]
        return all(name in found for found in within)

    return [name for name in names if everywhere(name)]
