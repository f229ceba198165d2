"""A measured number beside the known one, and chapters of them; tests assert on these, documents print them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any


@dataclass(frozen=True)
class Benchmark:
    """One comparison; `error` is what must not exceed `bound`, both of the kind that `quantity` names.

    `exact` is None where only the error has a meaning, such as the noise of a scan.
    """

    case: str
    quantity: str
    measured: float
    exact: float | None
    error: float
    bound: float

    @property
    def passed(self) -> bool:
        """Whether the error is a number within its bound."""
        return isfinite(self.error) and self.error <= self.bound


def relative(case: str, quantity: str, measured: float, exact: float, bound: float) -> Benchmark:
    """Return a benchmark on |measured - exact| / |exact|."""
    return Benchmark(case, quantity, measured, exact, abs(measured - exact) / abs(exact), bound)


def absolute(case: str, quantity: str, measured: float, exact: float, bound: float) -> Benchmark:
    """Return a benchmark on |measured - exact|."""
    return Benchmark(case, quantity, measured, exact, abs(measured - exact), bound)


def at_most(case: str, quantity: str, measured: float, bound: float) -> Benchmark:
    """Return a benchmark on a size that ought to be as small as it can be."""
    return Benchmark(case, quantity, measured, None, abs(measured), bound)


def at_least(case: str, quantity: str, measured: float, bound: float) -> Benchmark:
    """Return a benchmark on a number that must reach a bound; the error is by how much it falls short."""
    short = 0.0 if measured >= bound else bound - measured  # not max(), which would take NaN for none
    return Benchmark(case, f"{quantity} (at least)", measured, bound, short, 0.0)


@dataclass(frozen=True)
class Table:
    """Numbers that are shown and not judged."""

    caption: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Figure:
    """A figure by its file name under docs/figures, with the function that draws it on a matplotlib figure."""

    name: str
    caption: str
    draw: Callable[[Any], None]
    size_in: tuple[float, float] = (8.0, 3.6)


@dataclass(frozen=True)
class Chapter:
    """One benchmark problem: a sentence on what is claimed, where the known answer is from, and what was measured.

    `facts` are numbers that the page's prose quotes. `skipped` says why nothing was measured; then there are no
    benchmarks.
    """

    title: str
    claim: str
    source: str
    benchmarks: tuple[Benchmark, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = field(default=(), compare=False)
    skipped: str = ""
    facts: Mapping[str, Any] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether every benchmark holds its bound."""
        return all(benchmark.passed for benchmark in self.benchmarks)
