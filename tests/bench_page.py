"""The page of `make bench`: each figure of all runs beside its bound, and what was asked for and is not reached."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
from bench_table import Figure

from host_tools.pages.benchmark import Chapter, Table
from host_tools.pages.page import Results, Timed, write_page

PAGE = "speed"
HEADER = ("what", "median", "least", "most", "unit", "bound", "on this machine", "")


def medians(runs: Sequence[Sequence[Figure]]) -> list[Figure]:
    """Return each figure of the first run with its median over all: one run beside a busy neighbour says nothing."""
    return [replace(one, value=float(np.median(values_of(one.name, runs)))) for one in runs[0]]


def values_of(name: str, runs: Sequence[Sequence[Figure]]) -> list[float]:
    """Return a figure's values, one a run; raises `ValueError` where a run lacks it."""
    values = [figure.value for run in runs for figure in run if figure.name == name]
    if len(values) != len(runs):
        raise ValueError(
            f"{name} is {len(values)} times in {len(runs)} runs, but must be in each once: give it one name"
        )
    return values


def write_speed(
    out: Path, order: Sequence[str], runs: Mapping[str, Sequence[Sequence[Figure]]], seconds: Mapping[str, float]
) -> None:
    """Write the page of chapters that were run some times each, with those of before in the bench's `order`.

    `seconds` is what all runs of a chapter took together.
    """
    timed = {name: Timed(_chapter(name, of_chapter), seconds[name]) for name, of_chapter in runs.items()}
    count = max(len(of_chapter) for of_chapter in runs.values())
    command = f'make bench ONLY="{" ".join(runs)}" RUNS={count} OUT=docs/{PAGE}.md'
    write_page(out, Results(PAGE, command, timed).in_chapters(out, order))


def _chapter(name: str, runs: Sequence[Sequence[Figure]]) -> Chapter:
    claim = (import_module(f"bench_{name}").__doc__ or "").split("\n\n")[0].replace("\n", " ")
    found = medians(runs)
    missed = [one.name for one in found if not one.holds]
    return Chapter(
        title=found[0].chapter.capitalize(),
        claim=claim,
        source=f"tests/bench_{name}.py",
        tables=(
            Table(
                "One run" if len(runs) == 1 else f"Medians of {len(runs)} runs",
                HEADER,
                tuple(_row(one, values_of(one.name, runs)) for one in found),
            ),
        ),
        facts={
            "values": {one.name: float(f"{one.value:.4g}") for one in found},
            "bounded": sum(one.bound is not None for one in found),
            "missed": missed,
        },
    )


def _row(found: Figure, values: Sequence[float]) -> tuple[str, ...]:
    sign = "at least" if found.at_least else "at most"
    bound = "" if found.bound is None else f"{sign} {found.bound:g}"
    word = "" if found.bound is None else "holds" if found.holds else "**missed**"
    shown = (f"{one:.3g}" for one in (found.value, min(values), max(values)))
    return (found.name, *shown, found.unit, bound, found.here.removesuffix(" here"), word)
