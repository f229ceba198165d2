"""Coverage of the 90 % intervals, by the octiles of every unknown, as the model card states it.

The card's presses were drawn when the model was trained; nothing has been fitted to them. An interval that holds on
average may fail the small and hard inclusions: so each unknown is counted by octiles of size, of depth and of modulus.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from device.measurement.confidence_belt import COVERAGE
from device.measurement.estimate import SPOKEN
from device.measurement.mode import Mode
from device.measurement.quantities import UNKNOWNS
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least
from host_tools.press_models.confidence_belts import RAREST_RATIO
from host_tools.press_models.mode_statistics import OCTILES

LOWEST, HIGHEST, LOWEST_IN_OCTILE = 0.87, 0.93, 0.85
FEWEST_IN_OCTILE = 60
"""Fewer determined presses than that say nothing of an octile: their coverage strays by 4 %."""
JOINT = {"size_and_depth": "size and depth together", "all": "all three together"}


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
            benchmarks.append(_recorded(case, recorded["presses"], recorded[name]))
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
            *(_by_octiles_of(name, stated) for name in UNKNOWNS),
            Table("Intervals that hold together, where both or all are determined", JOINT_HEADER,
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
JOINT_HEADER = ("mode", "presses", *JOINT.values())


def _case(mode: Mode, name: str) -> str:
    return f"{mode}, {SPOKEN[name]}"


def _benchmarks(case: str, stated: Mapping[str, Any]) -> list[Benchmark]:
    overall = _number(stated["coverage"])
    benchmarks = [Benchmark(case, "coverage", overall, COVERAGE, abs(overall - COVERAGE), HIGHEST - COVERAGE)]
    for by in UNKNOWNS:
        octiles = [covered for covered in _evaluated(stated, by) if covered is not None]
        if octiles:
            quantity = f"coverage in the worst octile of {SPOKEN[by]}"
            benchmarks.append(at_least(case, quantity, min(octiles), LOWEST_IN_OCTILE))
    return benchmarks


def _evaluated(stated: Mapping[str, Any], by: str) -> list[float | None]:
    """Return the coverage in each octile of an unknown's truth; None where too few presses are determined."""
    pairs = zip(stated["coverage_by_octiles"][by], stated["determined_by_octiles"][by], strict=True)
    of_octile = stated["presses"] / OCTILES
    return [covered if known and known * of_octile >= FEWEST_IN_OCTILE else None for covered, known in pairs]


def _recorded(case: str, presses: int, stated: Mapping[str, Any]) -> Benchmark:
    """Return the coverage of recordings against the lowest that chance allows."""
    counted = max(presses * stated["determined"], 1.0)
    error = math.sqrt(COVERAGE * (1 - COVERAGE) / counted)
    return at_least(case, "coverage of recordings", _number(stated["coverage"]), LOWEST - 2 * error)


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _row(case: str, stated: Mapping[str, Any]) -> tuple[str, ...]:
    octiles = zip(stated["mean_percent_per_octile"], stated["coverage_per_octile"], strict=True)
    cells = (f"{error:.1f} % ({_share(covered)})" for error, covered in octiles)
    return case, f"{stated['skill']:.2f}", f"{stated['interval_score']:.2f}", f"{stated['determined']:.0%}", *cells


def _by_octiles_of(by: str, stated: Mapping[tuple[Mode, str], Mapping[str, Any]]) -> Table:
    """Return the coverage of every unknown by the octiles of one of them, with the share that is determined."""
    rows = []
    for (mode, name), of_unknown in stated.items():
        pairs = zip(of_unknown["coverage_by_octiles"][by], of_unknown["determined_by_octiles"][by], strict=True)
        rows.append((_case(mode, name), *(f"{_share(covered)} of {_share(known)}" for covered, known in pairs)))
    caption = f"Coverage of the share that is determined, by octiles of {SPOKEN[by]}, lowest first"
    return Table(caption, ("mode, unknown", *OCTILE_COLUMNS), tuple(rows))


def _joint_row(mode: Mode, part: str, statistics: Mapping[str, Any]) -> tuple[str, ...]:
    return mode, f"{part}, {statistics['presses']}", *(_share(statistics["joint"][name]) for name in JOINT)


def _share(share: float | None) -> str:
    return "-" if share is None else f"{share:.0%}"
