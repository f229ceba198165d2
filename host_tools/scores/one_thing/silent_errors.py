"""What no test of a mode notices: relaxing tissue, a stiff layer below, an inclusion that is longer towards the depth.

Rows of a world are pressed as in `one_at_a_time`, the same presses in each. Prolate inclusions are solved by finite
elements, each under both presses of its scan, and carried on to the probe's own sphere; beside them balls of the same
volume, as deep and on the same skins. All tissue is of 4-6 kPa: a layer below is solved there alone. The bound is on
how much further off sizes and depths are than without the thing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import HIGH, NEAR_NOMINAL
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.ramp_modes.surrogate import OFFSET, SIZE
from device.simulation.physics.world import AS_BELIEVED
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_most
from host_tools.press_models.press_samples import draw_around
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.probe_tables.ellipsoid import stretched_inclusion
from host_tools.scenes.scene import Placement, Scene
from host_tools.scores.foreign_presses import FURTHER_MM
from host_tools.scores.one_thing.causes import FOUR_TIMES_SLOWER_N_PER_S, NOTHING, Cause, relaxing, stiff_below
from host_tools.scores.one_thing.press_answers import (
    SHIPPED,
    TOLERANT,
    DesignToTry,
    quick_scores,
    ramp_scores,
    with_tolerances,
)
from host_tools.scores.one_thing.tried_presses import (
    Setting,
    SettingsOf,
    TruthDesign,
    random_design,
    scans_of,
    tried_presses,
)
from host_tools.scores.outside import clear_inclusions
from host_tools.scores.scored_presses import FIGURES, ScoredPresses, figures_of, paired

PRESSES = 40
INCLUSIONS, SKINS = 4, 9
"""Prolate inclusions of each kind that are solved, and presses of each."""
TIMES_AS_HIGH = 1.25, 1.5
BALL = "balls of their volume"
BOUND_MM = 1.0
"""How much further off than without it a thing leaves sizes and depths, in the mean."""
NEAREST_OFFSET_MM = 0.1
"""On the axis itself no table of inclusions aside is asked."""
MODES = {
    f"standard {SHIPPED}": ("standard", SHIPPED),
    "standard after": ("standard", TOLERANT),
    "precise after": ("precise", TOLERANT),
    "quick": ("quick", SHIPPED),
}
BOUNDED = "standard after", "precise after"
HEADER = ("what differs", "mode", "answered by", *FIGURES, "size further off (mm)", "depth further off (mm)",
          "size moved, RMS (mm)", "depth moved, RMS (mm)")  # fmt: skip
Scores = dict[str, ScoredPresses]


def silent_errors_chapter(
    design: DesignToTry,
    *,
    presses: int = PRESSES,
    scans: int | None = None,
    inclusions: int = INCLUSIONS,
    seed: int = 1,
    jobs: int = -1,
) -> Chapter:
    """Return what each silent error leaves in sizes and depths, and how little of it is refused."""
    scans = scans_of(presses) if scans is None else scans
    own, truths = with_tolerances(design, seed), random_design(presses, scans, seed, ranges=NEAR_NOMINAL)

    def answered(of_design: TruthDesign, settings_of: SettingsOf) -> Scores:
        taken = tried_presses(of_design, settings_of, design.model.answers.noise, jobs=jobs)
        ramps = ramp_scores(taken, design, own, jobs)
        return ramps | {"quick": quick_scores(of_design.parameters, taken.held, design.quick)}

    slowest = relaxing(10, FOUR_TIMES_SLOWER_N_PER_S)
    worlds = (NOTHING, relaxing(5), relaxing(10), slowest, stiff_below(2.0))
    found = {cause.name: answered(truths, _of_cause(cause, design.tables)) for cause in worlds}
    without = dict.fromkeys(found, found[NOTHING.name])
    balls = _balls(inclusions, scans, seed)
    found[BALL] = answered(balls, _of_cause(NOTHING, design.tables))
    for times in TIMES_AS_HIGH:
        prolate = _as_prolate(balls, times)
        solved = solved_prolate(prolate, inclusions, times, design.tables, jobs)
        found[f"prolate, {times:g} times as high as wide"] = answered(prolate, _of_solved(solved))
    without |= {name: found[BALL] for name in found if name not in without}
    return Chapter(
        title="Silent errors",
        claim=f"{presses} random presses of each world, and {len(balls.parameters)} of {inclusions} prolate inclusions "
        f"of each kind; the first {scans} are scans of two.",
        source="host_tools/scores/one_thing/silent_errors.py; host_tools/probe_tables/ellipsoid.py",
        benchmarks=tuple(_benchmarks(found, without)),
        tables=(Table("What each leaves", HEADER, tuple(_rows(found, without))),),
        facts={
            "presses": presses,
            "scans": scans,
            "bound_mm": BOUND_MM,
            "largest": _largest(further_off_mm, found, without),
            "largest_moved": _largest(moved_mm, found, without),
            "standard": {name: _facts(of_one["standard after"]) for name, of_one in found.items()},
        },
    )


def _of_cause(cause: Cause, tables: ProbeTables) -> SettingsOf:
    return lambda number, rng: [Setting(tables, world) for world in cause.worlds(rng)]


def _of_solved(solved: Sequence[Sequence[ProbeTables]]) -> SettingsOf:
    return lambda number, rng: [Setting(tables, AS_BELIEVED) for tables in solved[number % len(solved)]]


def _balls(inclusions: int, scans: int, seed: int) -> TruthDesign:
    """Return presses of a few balls that show well, each on several skins, at places of its own."""
    rng = np.random.default_rng(derived_seed(seed, "prolate inclusions"))
    balls = np.tile(clear_inclusions(inclusions, rng), (SKINS, 1))
    parameters = draw_around(balls, rng, ranges=NEAR_NOMINAL)
    parameters[:, OFFSET] = np.tile(_offsets_mm(inclusions, rng), SKINS)
    further_mm = np.tile(rng.uniform(*FURTHER_MM, inclusions), SKINS)
    return TruthDesign(parameters, parameters, further_mm, scans, seed)


def _offsets_mm(count: int, rng: np.random.Generator) -> Array:
    """Return offsets even over the trained disk, none on the axis itself."""
    return np.asarray(np.maximum(HIGH[OFFSET] * np.sqrt(rng.uniform(0, 1, count)), NEAREST_OFFSET_MM))


def _as_prolate(balls: TruthDesign, times_as_high: float) -> TruthDesign:
    """Return presses of inclusions that are higher than wide, as large as balls and as deep, which are to be found."""
    pressed = np.array(balls.parameters)
    pressed[:, SIZE] *= times_as_high ** (2 / 3)
    return balls._replace(pressed=pressed)


def solved_prolate(
    prolate: TruthDesign, inclusions: int, times_as_high: float, tables: ProbeTables, jobs: int
) -> list[list[ProbeTables]]:
    """Return the tables of both presses of each inclusion; some seconds each."""
    places = np.column_stack([prolate.pressed[:inclusions, OFFSET], prolate.further_mm[:inclusions]])

    def solved(number: int) -> ProbeTables:
        inclusion, press = divmod(number, 2)
        ellipsoid, ratio = Inclusion(*map(float, prolate.pressed[inclusion, :3])), 1 / times_as_high
        place = Placement(float(places[inclusion, press]), width_ratio_x=ratio, width_ratio_y=ratio)
        return replace(tables, off_axis=stretched_inclusion(Scene(ellipsoid, placement=place), tables.off_axis))

    flat = in_parallel(solved, 2 * inclusions, jobs)
    return [flat[2 * number : 2 * number + 2] for number in range(inclusions)]


def further_off_mm(found: ScoredPresses, without: ScoredPresses) -> Array:
    """Return by how much more the mean errors of size and depth [2] are than without a thing; NaN without answers."""
    moves = _moves_mm(found, without)
    return np.asarray(moves.mean(axis=0)) if len(moves) else np.full(2, np.nan)


def moved_mm(found: ScoredPresses, without: ScoredPresses) -> Array:
    """Return by how much a thing moves answers of size and depth [2], root mean square; NaN without any."""
    moves = _moves_mm(found, without)
    return np.asarray(np.sqrt(np.mean(moves**2, axis=0))) if len(moves) else np.full(2, np.nan)


def _moves_mm(found: ScoredPresses, without: ScoredPresses) -> Array:
    """Return by how much a thing moves size and depth [n, 2] of presses that are answered with and without it."""
    found, without = paired(found, without)
    both = found.is_answered & without.is_answered
    return found.part(both).error_mm() - without.part(both).error_mm()


def _rows(found: Mapping[str, Scores], without: Mapping[str, Scores]) -> list[tuple[str, ...]]:
    rows = []
    for name, of_one in found.items():
        for kind, (mode, by) in MODES.items():
            further = further_off_mm(of_one[kind], without[name][kind])
            moved = moved_mm(of_one[kind], without[name][kind])
            shown = [*(f"{one:+.2f}" for one in further), *(f"{one:.2f}" for one in moved)]
            cells = ("" if cell.endswith("nan") else cell for cell in shown)
            rows.append((name, mode, by, *figures_of(of_one[kind]), *cells))
    return rows


def _benchmarks(found: Mapping[str, Scores], without: Mapping[str, Scores]) -> list[Benchmark]:
    return [
        at_most(f"{name}, {MODES[kind][0]}", f"{unknown} further off", float(one), BOUND_MM)
        for name, of_one in found.items()
        if of_one is not without[name]
        for kind in BOUNDED
        for unknown, one in zip(UNKNOWNS[:2], further_off_mm(of_one[kind], without[name][kind]), strict=True)
    ]


def _facts(found: ScoredPresses) -> dict[str, float | list[float]]:
    """Return what is refused of presses, and how often determined sizes and depths of the others are covered."""
    covered = found.determined_covered()
    return {
        "refused": round(1 - found.share_answered(), 3),
        "covered": [] if np.isnan(covered).any() else [round(float(one), 3) for one in covered],
    }


def _largest(
    of: Callable[[ScoredPresses, ScoredPresses], Array], found: Mapping[str, Scores], without: Mapping[str, Scores]
) -> list[float]:
    """Return the largest of what is further off or moved, of size and depth (mm), in the modes with a bound."""
    all_of_them = [of(found[name][kind], without[name][kind]) for name in found for kind in BOUNDED]
    return [round(float(one), 2) for one in np.nanmax(np.abs(all_of_them), axis=0)]
