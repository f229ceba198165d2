"""Coverage of the 90 % intervals, by octiles and cells of the unknowns, and of joint regions, as the card states it.

The card's presses were drawn when the model was trained; nothing has been fitted to them. An interval that holds on
average may fail the small and hard inclusions: so each unknown is counted by octiles of size, of depth and of modulus,
and by cells of size and depth. That it is called determined is thereby judged where it is said. The joint regions are
those of `joint_region`; the rectangle of two intervals, which the screen shows, holds less often and is stated beside.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np

from device.measurement.confidence_belt import COVERAGE
from device.measurement.estimate import SPOKEN
from device.measurement.mode import Mode
from device.measurement.parameters import RANGES
from device.measurement.quantities import UNKNOWNS
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least
from host_tools.press_models.confidence_belts import RAREST_RATIO
from host_tools.press_models.mode_statistics import OCTILES
from host_tools.press_models.mode_statistics import PARTS as CELL_PARTS

LOWEST, HIGHEST, LOWEST_IN_OCTILE = 0.87, 0.93, 0.85
FEWEST_IN_OCTILE = 60
"""Fewer determined presses than that say nothing of an octile or a cell: their coverage strays by 4 %."""
TOGETHER = {"size_and_depth": "size and depth", "all": "all three"}


def coverage_chapter(cards: Mapping[Mode, Mapping[str, Any]]) -> Chapter:
    """Return coverage overall and in the worst octile of every unknown, of each mode's model card.

    Also errors, skill and interval score, and how often intervals hold together.
    """
    entries = {mode: card["modes"][mode] for mode, card in cards.items()}
    stated = {
        (mode, name): entry["simulated"][name] | {"presses": entry["simulated"]["presses"]}
        for mode, entry in entries.items()
        for name in UNKNOWNS
    }
    benchmarks: list[Benchmark] = []
    for (mode, name), of_unknown in stated.items():
        if of_unknown["determined"]:
            case = _case(mode, name)
            benchmarks += _benchmarks(case, of_unknown)
            recorded = entries[mode]["recorded"]
            benchmarks += _of_recordings(case, recorded[name] | {"presses": recorded["presses"]})
    benchmarks += [
        one for mode, entry in entries.items() for part in PARTS for one in _regions(mode, part, entry[part])
    ]
    numbers = ", ".join(f"{entry['simulated']['presses']} in {mode}" for mode, entry in entries.items())
    return Chapter(
        title="Intervals hold what they promise",
        claim=f"Random presses with camera noise and every nuisance ({numbers}), and simulated recordings.",
        source="models/quick/model.json, models/standard/model.json; host_tools/press_models/mode_outcome.py",
        benchmarks=tuple(benchmarks),
        tables=(
            Table(
                "By octiles of the truth, lowest first: mean error (coverage)",
                HEADER,
                tuple(_row(_case(*key), of_unknown) for key, of_unknown in stated.items()),
            ),
            *(_by_octiles_of(name, part, entries) for part in PARTS for name in UNKNOWNS),
            Table("Coverage of the share that is determined, by size and depth", CELL_HEADER,
                  tuple(row for key, of_unknown in stated.items() for row in _cell_rows(_case(*key), of_unknown))),
            Table("What holds together: regions, of all presses, and intervals, where both or all are determined",
                  JOINT_HEADER,
                  tuple(_joint_row(mode, part, entry[part]) for mode, entry in entries.items() for part in PARTS)),
        ),
        facts={
            "rarest_ratio": RAREST_RATIO,
            "fewest_in_octile": FEWEST_IN_OCTILE,
            "lowest_in_octile": LOWEST_IN_OCTILE,
        },
    )  # fmt: skip


OCTILE_COLUMNS = tuple(f"octile {number}" for number in range(1, OCTILES + 1))
HEADER = ("mode, unknown", "skill", "interval score", "determined", *OCTILE_COLUMNS)
PARTS = ("simulated", "recorded")
JOINT_HEADER = (
    "mode",
    "presses",
    *(f"{what} of {name}" for name in TOGETHER.values() for what in ("region", "intervals")),
)


def _ends_mm(name: str) -> list[str]:
    """Return the parts of an unknown's range that the cells are made of."""
    ends = np.linspace(RANGES[name].low, RANGES[name].high, CELL_PARTS + 1)
    return [f"{low:g}-{high:g} mm" for low, high in pairwise(ends)]


CELL_HEADER = ("mode, unknown", "size", *(f"depth {part}" for part in _ends_mm("depth_mm")))


def _case(mode: Mode, name: str) -> str:
    return f"{mode}, {SPOKEN[name]}"


def _benchmarks(case: str, stated: Mapping[str, Any]) -> list[Benchmark]:
    overall = _number(stated["coverage"])
    benchmarks = [Benchmark(case, "coverage", overall, COVERAGE, abs(overall - COVERAGE), HIGHEST - COVERAGE)]
    for by in UNKNOWNS:
        if octiles := [covered for covered, _ in _octiles(stated, by)]:
            quantity = f"coverage in the worst octile of {SPOKEN[by]}"
            benchmarks.append(at_least(case, quantity, min(octiles), LOWEST_IN_OCTILE))
    if cells := [covered / known for _, known, covered in _cells(stated) if known >= FEWEST_IN_OCTILE]:
        benchmarks.append(at_least(case, "coverage in the worst cell of size and depth", min(cells), LOWEST_IN_OCTILE))
    return benchmarks


def _octiles(stated: Mapping[str, Any], by: str) -> list[tuple[float, float]]:
    """Return the coverage in each octile of an unknown's truth that is judged, and how many presses are determined."""
    pairs = zip(stated["coverage_by_octiles"][by], stated["determined_by_octiles"][by], strict=True)
    counted = [(covered, (known or 0.0) * stated["presses"] / OCTILES) for covered, known in pairs]
    return [(covered, known) for covered, known in counted if covered is not None and known >= FEWEST_IN_OCTILE]


def _cells(stated: Mapping[str, Any]) -> list[tuple[int, int, int]]:
    """Return of each cell of size and depth: presses, determined and covered; none of a card that does not say."""
    cells = stated.get("cells", {})
    return list(zip(*(cells.get(name, ()) for name in ("presses", "determined", "covered")), strict=True))


def _of_recordings(case: str, stated: Mapping[str, Any]) -> list[Benchmark]:
    """Return the coverage of recordings, overall and in each unknown's worst octile, against what chance allows."""
    known = max(stated["presses"] * stated["determined"], 1.0)
    found = [at_least(case, "coverage of recordings", _number(stated["coverage"]), LOWEST - 2 * _error(known))]
    for by in UNKNOWNS:
        allowed = [(covered, LOWEST_IN_OCTILE - 2 * _error(known)) for covered, known in _octiles(stated, by)]
        if allowed:
            worst = min(allowed, key=lambda one: one[0] - one[1])
            found.append(at_least(case, f"coverage of recordings in the worst octile of {SPOKEN[by]}", *worst))
    return found


def _regions(mode: Mode, part: str, stated: Mapping[str, Any]) -> list[Benchmark]:
    """Return how often the joint regions hold; nothing of a mode that has none."""
    recordings = part == "recorded"
    bound = LOWEST - 2 * _error(stated["presses"]) if recordings else LOWEST
    quantity = f"joint 90 % region holds{' in recordings' if recordings else ''}"
    found = stated.get("joint_region", {})
    return [at_least(f"{mode}, {TOGETHER[name]}", quantity, _number(share), bound) for name, share in found.items()]


def _error(counted: float) -> float:
    """Return the standard error of a coverage of so many intervals."""
    return math.sqrt(COVERAGE * (1 - COVERAGE) / counted)


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _row(case: str, stated: Mapping[str, Any]) -> tuple[str, ...]:
    octiles = zip(stated["mean_percent_per_octile"], stated["coverage_per_octile"], strict=True)
    cells = (f"{error:.1f} % ({_share(covered)})" for error, covered in octiles)
    return case, f"{stated['skill']:.2f}", f"{stated['interval_score']:.2f}", f"{stated['determined']:.0%}", *cells


def _by_octiles_of(by: str, part: str, entries: Mapping[Mode, Mapping[str, Any]]) -> Table:
    """Return the coverage of every unknown by the octiles of one of them, with the share that is determined."""
    rows = []
    for mode, entry in entries.items():
        for name in UNKNOWNS:
            stated = entry[part][name]
            pairs = zip(stated["coverage_by_octiles"][by], stated["determined_by_octiles"][by], strict=True)
            rows.append((_case(mode, name), *(f"{_share(covered)} of {_share(known)}" for covered, known in pairs)))
    caption = f"Coverage of the share that is determined, {part} presses by octiles of {SPOKEN[by]}, lowest first"
    return Table(caption, ("mode, unknown", *OCTILE_COLUMNS), tuple(rows))


def _cell_rows(case: str, stated: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Return a row for each part of the sizes: coverage of the determined share in each part of the depths."""
    cells = [
        f"{_share(covered / known if known else None)} of {_share(known / presses if presses else None)}"
        for presses, known, covered in _cells(stated)
    ]
    rows = [tuple(cells[start : start + CELL_PARTS]) for start in range(0, len(cells), CELL_PARTS)]
    return [(case, size, *row) for size, row in zip(_ends_mm("size_mm"), rows, strict=False)]


def _joint_row(mode: Mode, part: str, stated: Mapping[str, Any]) -> tuple[str, ...]:
    regions = stated.get("joint_region", {})
    shares = (_share(of.get(name)) for name in TOGETHER for of in (regions, stated["joint"]))
    return mode, f"{part}, {stated['presses']}", *shares


def _share(share: float | None) -> str:
    return "-" if share is None else f"{share:.0%}"
