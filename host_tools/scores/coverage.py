"""Coverage of the 90 % intervals, by the octiles of each unknown, as the model card states it.

The card's presses were drawn when the model was trained; neither networks nor belts have seen them.
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

LOWEST, HIGHEST, LOWEST_IN_OCTILE = 0.88, 0.92, 0.85
FEWEST_IN_OCTILE = 60
"""Fewer determined presses than that say nothing of an octile: their coverage strays by 4 %."""


def coverage_chapter(cards: Mapping[Mode, Mapping[str, Any]]) -> Chapter:
    """Return coverage overall and in the worst octile, and errors and skill by octile, of each mode's model card."""
    benchmarks: list[Benchmark] = []
    rows: list[tuple[str, ...]] = []
    for mode, card in cards.items():
        entry = card["modes"][mode]
        for name in UNKNOWNS:
            case = f"{mode}, {SPOKEN[name]}"
            if entry["simulated"][name]["determined"]:
                benchmarks += _benchmarks(case, entry["simulated"]["presses"], entry["simulated"][name])
                benchmarks.append(_recorded(case, entry["recorded"]["presses"], entry["recorded"][name]))
            rows.append(_row(case, entry["simulated"][name]))
    numbers = ", ".join(f"{card['modes'][mode]['simulated']['presses']} in {mode}" for mode, card in cards.items())
    return Chapter(
        title="Intervals hold what they promise",
        claim=f"Random presses with camera noise and every nuisance ({numbers}), and simulated recordings.",
        source="models/quick/model.json, models/standard/model.json; host_tools/press_models/mode_outcome.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("By octiles of the truth, lowest first: mean error (coverage)", HEADER, tuple(rows)),),
        facts={"rarest_ratio": RAREST_RATIO, "fewest_in_octile": FEWEST_IN_OCTILE},
    )


HEADER = ("mode, unknown", "skill", "determined", *(f"octile {number}" for number in range(1, OCTILES + 1)))


def _benchmarks(case: str, presses: int, stated: dict[str, Any]) -> list[Benchmark]:
    middle = (LOWEST + HIGHEST) / 2
    pairs = zip(stated["coverage_per_octile"], stated["determined_per_octile"], strict=True)
    octiles = [covered for covered, known in pairs if known * presses / OCTILES >= FEWEST_IN_OCTILE]
    overall = _number(stated["coverage"])
    benchmarks = [Benchmark(case, "coverage", overall, COVERAGE, abs(overall - middle), HIGHEST - middle)]
    if octiles:
        benchmarks.append(at_least(case, "coverage in the worst octile", min(octiles), LOWEST_IN_OCTILE))
    return benchmarks


def _recorded(case: str, presses: int, stated: dict[str, Any]) -> Benchmark:
    """Return the coverage of recordings against the lowest that chance allows."""
    counted = max(presses * stated["determined"], 1.0)
    error = math.sqrt(COVERAGE * (1 - COVERAGE) / counted)
    return at_least(case, "coverage of recordings", _number(stated["coverage"]), LOWEST - 2 * error)


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _row(case: str, stated: dict[str, Any]) -> tuple[str, ...]:
    octiles = zip(stated["mean_percent_per_octile"], stated["coverage_per_octile"], strict=True)
    cells = (f"{error:.1f} % ({'-' if covered is None else f'{covered:.0%}'})" for error, covered in octiles)
    return case, f"{stated['skill']:.2f}", f"{stated['determined']:.0%}", *cells
