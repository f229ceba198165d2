"""One thing at a time: the same presses in worlds that differ in one, in every mode, before and after.

"As it ships" is as if the simulated probe's bundles were this probe's own. "After" is by what allows for a builder's
tolerances and a hand's habits; where a thing is the probe's, modes of ramps are commissioned on phantoms that it
pressed. Mode quick is trained once, on tolerances and habits alone: each training takes minutes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby

import numpy as np

from device.measurement.mode import Mode
from device.measurement.quick_mode.model import QuickModel
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_least
from host_tools.scenes.phantom_set import PhantomSet
from host_tools.scores.one_thing.causes import Cause, CauseOwner, causes
from host_tools.scores.one_thing.cost_figure import cost_figure
from host_tools.scores.one_thing.press_answers import (
    COMMISSIONED,
    SHIPPED,
    TOLERANT,
    DesignToTry,
    OwnLimits,
    commissioned,
    quick_scores,
    quick_with_tolerances,
    ramp_scores,
    with_tolerances,
)
from host_tools.scores.one_thing.tried_presses import Setting, TruthDesign, random_design, scans_of, tried_presses
from host_tools.scores.scored_presses import FIGURES, ScoredPresses, covered_at_least, figures_of

PRESSES = 40
"""Presses of each thing; `tried_presses.scans_of` says how many of them are scans of two in mode precise."""
COVERED, ANSWERED = 0.86, 0.95
"""What is asked for: of what is answered, how often an interval holds; of what stands out, how much is answered."""
TITLES = {
    f"standard {SHIPPED}": "Mode standard, as it ships",
    "standard after": "Mode standard, after",
    f"precise {SHIPPED}": "Mode precise, a scan of two, as it ships",
    "precise after": "Mode precise, a scan of two, after",
    f"quick {SHIPPED}": "Mode quick, as it ships",
    "quick after": "Mode quick, after",
}
AFTER: dict[Mode, str] = {"quick": "quick after", "standard": "standard after", "precise": "precise after"}
"""Modes to the answers that have bounds."""
HOLDS: dict[CauseOwner, str] = {
    "probe": "builder; phantoms tell it",
    "camera": "builder; a grid target undoes it",
    "press": "hand",
    "patient": "nobody",
    "nobody": "",
}
BOUNDED_OWNERS: tuple[CauseOwner, ...] = ("nobody", "probe", "press", "patient")
"""Whose things have bounds: a grid undoes a camera."""
Found = dict[str, list[ScoredPresses]]
"""Each of `TITLES` to its answers, cause by cause."""


def one_at_a_time_chapter(
    design: DesignToTry,
    phantoms: PhantomSet,
    *,
    presses: int = PRESSES,
    scans: int | None = None,
    tried: Sequence[Cause] | None = None,
    own_quick: QuickModel | None = None,
    seed: int = 1,
    jobs: int = -1,
) -> Chapter:
    """Return what each thing of `causes`, or of those given, costs alone; the first is that nothing differs.

    `own_quick` is mode quick by tolerances and habits; it is trained unless given.
    """
    all_of_them = list(tried or causes())
    of_probe = [cause for cause in all_of_them if cause.owner == "probe"]
    own = dict(zip((one.name for one in of_probe), commissioned(design, of_probe, phantoms, seed, jobs), strict=True))
    scans = scans_of(presses) if scans is None else scans
    unknown, truths = with_tolerances(design, seed), random_design(presses, scans, seed)
    quick = own_quick or quick_with_tolerances(design, seed, jobs)
    found: Found = {name: [] for name in TITLES}
    for cause in all_of_them:
        for name, one in _answered(design, truths, cause, own.get(cause.name, unknown), quick, jobs).items():
            found[name].append(one)
    return Chapter(
        title="One thing at a time",
        claim=f"{presses} random presses, the same ones in every row, of which the first {scans} are scans of two.",
        source="host_tools/scores/one_thing/causes.py; the same truths and noise in every row",
        benchmarks=tuple(_benchmarks(all_of_them, found)),
        tables=(_tightness(all_of_them, found), *(_table(name, all_of_them, found[name]) for name in TITLES)),
        figures=(_figure(all_of_them, found),),
        facts={
            "presses": presses,
            "scans": scans,
            "phantoms": phantoms.serial,
            "rows": {mode: _rows_held(mode, all_of_them, found[name]) for mode, name in AFTER.items()},
        },
    )


def _answered(
    design: DesignToTry, truths: TruthDesign, cause: Cause, own: OwnLimits, own_quick: QuickModel, jobs: int
) -> dict[str, ScoredPresses]:
    taken = tried_presses(
        truths,
        lambda number, rng: [Setting(design.tables, world) for world in cause.worlds(rng)],
        design.model.answers.noise,
        jobs=jobs,
    )
    models = {f"quick {SHIPPED}": design.quick, "quick after": own_quick}
    quick = {name: quick_scores(truths.parameters, taken.held, model) for name, model in models.items()}
    return ramp_scores(taken, design, own, jobs) | quick


def _benchmarks(tried: Sequence[Cause], found: Mapping[str, Sequence[ScoredPresses]]) -> list[Benchmark]:
    """Return what each row reaches of what is asked for, in each mode."""
    return [
        one
        for mode, name in AFTER.items()
        for cause, of_cause in zip(tried, found[name], strict=True)
        if cause.owner in BOUNDED_OWNERS
        for one in _of_row(mode, cause, of_cause)
    ]


def _of_row(mode: Mode, cause: Cause, found: ScoredPresses) -> list[Benchmark]:
    """Return what one row reaches; mode quick may refuse, and then has nothing to cover."""
    case, is_answered = f"{mode}, {cause.name}", bool(found.is_answered.any())
    if mode == "quick" and not is_answered:
        return []
    shares = [] if mode == "quick" else [at_least(case, "answered", found.share_answered(), ANSWERED)]
    return [*shares, *covered_at_least(case, found, COVERED)]


def _table(name: str, tried: Sequence[Cause], found: Sequence[ScoredPresses]) -> Table:
    if not name.endswith("after"):
        rows = [(one.quantity, one.size, *figures_of(of_one)) for one, of_one in zip(tried, found, strict=True)]
        return Table(TITLES[name], ("what differs", "by", *FIGURES), tuple(rows))
    is_commissioned = not name.startswith("quick")
    by = (COMMISSIONED if is_commissioned and one.owner == "probe" else TOLERANT for one in tried)
    rows = [
        (one.quantity, one.size, of_by, *figures_of(of_one))
        for one, of_by, of_one in zip(tried, by, found, strict=True)
    ]
    return Table(TITLES[name], ("what differs", "by", "answered by", *FIGURES), tuple(rows))


def holds(found: ScoredPresses, *, may_refuse: bool = False) -> bool:
    """Return whether presses are answered and covered as asked for, but for one standard deviation of chance.

    A mode that `may_refuse` needs to cover what it answers.
    """
    count, answered = int(found.stands_out.sum()), int(found.is_answered.sum())
    if not answered:
        return may_refuse
    determined = found.determined()[:, :2].sum(axis=0)
    shares = zip(found.determined_covered(), determined, strict=True)
    covers = all(share >= _but_for_chance(COVERED, count) for share, count in shares if count)
    return covers and (may_refuse or answered / count >= _but_for_chance(ANSWERED, count))


def _rows_held(mode: Mode, tried: Sequence[Cause], found: Sequence[ScoredPresses]) -> dict[str, int]:
    """Return how many rows have bounds in a mode, how many reach all bounds, and how many do but for chance."""
    bounded = [(cause, one) for cause, one in zip(tried, found, strict=True) if cause.owner in BOUNDED_OWNERS]
    reached = [all(one.passed for one in _of_row(mode, *row)) for row in bounded]
    but_for_chance = [holds(one, may_refuse=mode == "quick") for _, one in bounded]
    return {"bounded": len(bounded), "reached": sum(reached), "but_for_chance": sum(but_for_chance)}


def _but_for_chance(share: float, count: int) -> float:
    return float(share - np.sqrt(share * (1 - share) / count))


def _tightness(tried: Sequence[Cause], found: Mapping[str, Sequence[ScoredPresses]]) -> Table:
    """Return how far each quantity may be off in each mode, of the sizes that were tried."""
    rows = []
    numbered = enumerate(tried[1:], start=1)
    for quantity, of_one in groupby(numbered, key=lambda pair: pair[1].quantity):
        numbers, sizes = zip(*((number, cause.size) for number, cause in of_one), strict=True)
        of_modes = (
            _largest_held(sizes, [holds(found[name][number], may_refuse=mode == "quick") for number in numbers])
            for mode, name in AFTER.items()
        )
        rows.append((quantity, ", ".join(sizes), *of_modes, HOLDS[tried[numbers[0]].owner]))
    header = ("quantity", "tried", *(f"mode {mode} holds" for mode in AFTER), "who holds it")
    return Table("How tightly each quantity must be held", header, tuple(rows))


def _largest_held(sizes: Sequence[str], held: Sequence[bool]) -> str:
    """Return up to which of ascending sizes everything is as asked for, or which of two signs is."""
    if all(held):
        return "all tried" if len(sizes) > 1 else sizes[0]
    if {size[0] for size in sizes} == {"+", "-"}:
        return ", ".join(size for size, one in zip(sizes, held, strict=True) if one) or "**none tried**"
    first_lost = held.index(False)
    return f"up to {sizes[first_lost - 1]}" if first_lost else "**none tried**"


def _figure(tried: Sequence[Cause], found: Mapping[str, Sequence[ScoredPresses]]) -> Figure:
    names = [cause.name for cause in tried]
    return cost_figure(
        "robustness_one_thing.svg", names, {mode: found[name] for mode, name in AFTER.items()}, (COVERED, ANSWERED)
    )
