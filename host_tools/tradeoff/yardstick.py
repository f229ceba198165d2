"""Processor time as a multiple of a fixed piece of NumPy work that is timed in turns with it.

Machines differ, and this one is shared: only ratios are comparable. The yardstick is one 768 x 492 float32 image put
through exp and sum, about what any step on every pixel costs. Processor time, not wall time, so that neighbours count
little; that of finished subprocesses is in it, and of all threads.
"""

from __future__ import annotations

import resource
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

Worked = TypeVar("Worked")
WIDTH_PX, HEIGHT_PX = 768, 492
REPEATS = 5
YARDSTICK_CALLS = 40
SHORTEST_S = 0.05
"""Work shorter than this is repeated until it takes as long: clocks and caches would decide."""
MOST_CALLS = 10_000
MAYBE_SHORT_S = 0.2
"""Work whose first call takes less is called again before its calls are counted: the first one may make much ready."""
LONG_S = 1.0
"""Work longer than this is timed once, at its first call: what it makes ready counts little."""


class Cost(NamedTuple):
    """Processor time of one call: over the yardstick's, and in seconds of the machine that measured."""

    yardsticks: float
    seconds: float


@lru_cache(maxsize=1)
def picture() -> NDArray[np.float32]:
    """Return the image [492, 768] of the yardstick."""
    return np.random.default_rng(1).random((HEIGHT_PX, WIDTH_PX), dtype=np.float32)


def exp_and_sum() -> float:
    """Do the yardstick's work."""
    return float(np.exp(picture()).sum())


def cost(work: Callable[[], object], repeats: int = REPEATS, clock: Callable[[], float] | None = None) -> Cost:
    """Return what one call of `work` costs after a first one: the least of so many turns of each.

    The least, for what neighbours do to clocks and caches only adds.

    `clock` gives the seconds that count, `processor_s` unless told otherwise.
    """
    of_work = clock or processor_s
    first_s, yardstick_s = _seconds(work, 1, of_work), _seconds(exp_and_sum, YARDSTICK_CALLS, processor_s)
    if first_s > LONG_S:
        return Cost(first_s / yardstick_s, first_s)
    again_s = _seconds(work, 1, of_work) if first_s < MAYBE_SHORT_S else first_s
    calls = int(np.clip(np.ceil(SHORTEST_S / max(again_s, 1e-9)), 1, MOST_CALLS))
    turns = np.array([
        (_seconds(exp_and_sum, YARDSTICK_CALLS, processor_s), _seconds(work, calls, of_work)) for _ in range(repeats)
    ])  # fmt: skip
    yardstick_s, seconds = turns.min(axis=0)
    return Cost(float(seconds / yardstick_s), float(seconds))


def timed(work: Callable[[], Worked]) -> tuple[Worked, Cost]:
    """Return what one call of `work` gives, and its cost."""
    yardstick_s, began = _seconds(exp_and_sum, YARDSTICK_CALLS, processor_s), processor_s()
    result = work()
    seconds = processor_s() - began
    return result, Cost(seconds / yardstick_s, seconds)


def processor_s() -> float:
    """Return the processor time of this process and of its finished children, in seconds."""
    return _used_s(resource.RUSAGE_SELF) + subprocess_s()


def subprocess_s() -> float:
    """Return the processor time of the finished children alone, in seconds."""
    return _used_s(resource.RUSAGE_CHILDREN)


def _used_s(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


def _seconds(work: Callable[[], object], calls: int, clock: Callable[[], float]) -> float:
    """Return the time of one of so many calls."""
    began = clock()
    for _ in range(calls):
        work()
    return (clock() - began) / calls
