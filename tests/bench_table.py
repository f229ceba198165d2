"""One table of everything that is timed: each figure with its unit, its bound, and the change since another run.

Machines are noisy and differ. So a time is stated as a ratio to the yardstick of `host_tools tradeoff`, timed in turns.
"""

from __future__ import annotations

import json
import operator
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from host_tools.tradeoff.yardstick import cost, processor_s

YARDSTICKS = "yardsticks"
"""The unit of a time over the yardstick's."""
REPEATS = 9
Clock = Callable[[], float]
PROCESSOR, WALL = processor_s, time.perf_counter
"""The processor's clock stands still while others are busy on it; what waits for another process needs the wall's."""


@dataclass(frozen=True)
class Figure:
    """One line: `chapter` and `name` say what, `bound` is the most that is allowed, or of `at_least` the least.

    `here` is the same as a person reads it on this machine.
    """

    chapter: str
    name: str
    value: float
    unit: str = YARDSTICKS
    bound: float | None = None
    at_least: bool = False
    here: str = ""

    @property
    def holds(self) -> bool:
        """Whether the bound is kept; what is no number keeps none."""
        within = operator.ge if self.at_least else operator.le
        return self.bound is None or within(self.value, self.bound)

    def as_line(self, before: float | None = None) -> str:
        """Return the line of the table; `before` is the value of another run."""
        sign = ">=" if self.at_least else "<="
        bound = "" if self.bound is None else f"{sign} {self.bound:g}{'' if self.holds else '  MISSED'}"
        change = "" if before is None else f"{self.value / before - 1:+8.0%}" if before else f"{self.value:+8.3g}"
        return f"{self.name:56} {self.value:10.3g} {self.unit:12} {bound:18} {self.here:16} {change}".rstrip()


def median_seconds(work: Callable[[], object], repeats: int = REPEATS, clock: Clock = PROCESSOR) -> float:
    """Return the median time of one call after a warm-up: of the processor, unless by another clock."""
    work()
    times = []
    for _ in range(repeats):
        start = clock()
        work()
        times.append(clock() - start)
    return float(np.median(times))


def timed(chapter: str, name: str, work: Callable[[], object], bound: float | None = None, clock: Clock = PROCESSOR,
          repeats: int = REPEATS) -> Figure:  # fmt: skip
    """Return the figure of what one call costs: the least of some turns over the yardstick's."""
    takes = cost(work, repeats, clock)
    return Figure(chapter, name, takes.yardsticks, bound=bound, here=f"{1e3 * takes.seconds:.3g} ms here")


def print_table(figures: Iterable[Figure], before: Path | None = None) -> list[Figure]:
    """Print each figure as it comes, beside those of a file of `write_table`; return them all."""
    others = _values(before) if before else {}
    shown: list[Figure] = []
    for figure in figures:
        if not shown or shown[-1].chapter != figure.chapter:
            print(f"\n{figure.chapter}", flush=True)
        print("  " + figure.as_line(others.get((figure.chapter, figure.name))), flush=True)
        shown.append(figure)
    return shown


def write_table(figures: Iterable[Figure], path: Path) -> None:
    """Write the figures as JSON."""
    path.write_text(json.dumps([asdict(figure) for figure in figures], indent=1) + "\n", encoding="utf-8")


def _values(path: Path) -> dict[tuple[str, str], float]:
    entries = json.loads(path.read_text(encoding="utf-8"))
    return {(entry["chapter"], entry["name"]): float(entry["value"]) for entry in entries}
