"""How often each mode refuses numbers for presses that are not of one round inclusion inside the trained ranges.

Skin, tissue and slab are random for all of them. Large inclusions and shallow ones are not in the virtual probe's
tables and are solved by finite elements, each on its own. Inclusions that are not round: `ellipsoids`. The refusals of
ordinary presses are the false ones. All are recorded through the simulated camera with every drift, and answered as the
device answers them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from device.measurement.arrays import Array
from device.measurement.estimate import Estimate
from device.measurement.mode import Mode
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.model import RAMP_MODES
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.recording.recording import Recording
from device.simulation.physics.neighbour import Neighbour
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Chapter, Table, at_least, at_most
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.recorded_presses import in_parallel, recorded_press
from host_tools.press_models.seeds import press_seed
from host_tools.probe_tables.surface_table import press_ramps
from host_tools.scenes.scene import Scene

ORDINARY, PRESSES, SOLVED = 600, 40, 5
"""So many ordinary ones tell a share of 4 % to 0.8 %."""
SKINS_A_SOLUTION = 5
"""Presses of each solved inclusion, on other skins."""
CLEAR_SIZE_MM, CLEAR_DEPTH_MM, CLEAR_KPA = (5.0, 10.0), (4.0, 7.0), (30.0, 150.0)
"""Inclusions that show well, so that it is their company or shape that must be noticed."""
GAP_MM, WET_RATIO = (0.5, 4.0), (0.1, 0.6)
LARGE_MM, SHALLOW_MM = (17.5, 20.0), (2.5, 3.2)
RecordPress = Callable[[Mode, int], Recording]
Ends = tuple[float, float]
SHARE = "share refused"
REFUSED_AT_LEAST, FALSE_AT_MOST = 0.95, 0.05
EstimateOf = Callable[[Recording, Mode], Estimate]


@dataclass(frozen=True)
class Kind:
    """One kind of press: how many there are, and what records the one of a number in a mode."""

    name: str
    count: int
    record: RecordPress


def kinds(tables: ProbeTables, seed: int, jobs: int = -1) -> list[Kind]:
    """Return ordinary presses first, then those that are to be refused; some solves run here."""
    rng = np.random.default_rng(seed)
    record = partial(recorded_press, levels=ErrorLevels())
    ordinary, none, two, wet = (draw_parameters(count, rng) for count in (ORDINARY, PRESSES, PRESSES, PRESSES))
    none[:, 0] = 0.0
    two[:, :3] = clear_inclusions(len(two), rng)
    neighbours = [_beside(one, rng) for one in two]
    wet_ratios = rng.uniform(*WET_RATIO, len(wet))

    def simple(parameters: Array) -> RecordPress:
        return lambda mode, i: record(tables, parameters[i], mode, press_seed(seed, i))

    return [
        Kind("ordinary", ORDINARY, simple(ordinary)),
        Kind("no inclusion", PRESSES, simple(none)),
        Kind(
            "two inclusions",
            PRESSES,
            lambda mode, i: record(tables, two[i], mode, press_seed(seed, i), neighbour=neighbours[i]),
        ),
        Kind(
            "gel on the face",
            PRESSES,
            lambda mode, i: record(tables, wet[i], mode, press_seed(seed, i), wet_ratio=float(wet_ratios[i])),
        ),
        _solved("larger than trained (17.5-20 mm)", tables, LARGE_MM, CLEAR_DEPTH_MM, rng, seed, jobs),
        _solved("shallower than trained (2.5-3.2 mm)", tables, CLEAR_SIZE_MM, SHALLOW_MM, rng, seed, jobs),
    ]


def clear_inclusions(count: int, rng: np.random.Generator) -> Array:
    """Return size, depth and modulus [count, 3] of inclusions that show well."""
    return _inclusions(count, rng, CLEAR_SIZE_MM, CLEAR_DEPTH_MM)


def _inclusions(count: int, rng: np.random.Generator, sizes_mm: Ends, depths_mm: Ends) -> Array:
    """Return size, depth and modulus [count, 3]."""
    return np.column_stack([rng.uniform(low, high, count) for low, high in (sizes_mm, depths_mm, CLEAR_KPA)])


def _beside(first: Array, rng: np.random.Generator) -> Neighbour:
    size_mm, depth_mm, modulus_kpa = map(float, clear_inclusions(1, rng)[0])
    away_mm, angle = (first[0] + size_mm) / 2 + rng.uniform(*GAP_MM), rng.uniform(0, 2 * np.pi)
    return Neighbour(size_mm, depth_mm, modulus_kpa, float(away_mm * np.cos(angle)), float(away_mm * np.sin(angle)))


def _solved(
    name: str,
    tables: ProbeTables,
    sizes_mm: Ends,
    depths_mm: Ends,
    rng: np.random.Generator,
    seed: int,
    jobs: int,
) -> Kind:
    """Return presses in the middle of spheres that the tables do not hold, in the nominal slab."""
    inclusions = _inclusions(SOLVED, rng, sizes_mm, depths_mm)
    ramps = in_parallel(lambda i: press_ramps(Scene(Inclusion(*map(float, inclusions[i])))), SOLVED, jobs)
    parameters = draw_parameters(SOLVED * SKINS_A_SOLUTION, rng)
    parameters[:, :3] = np.repeat(inclusions, SKINS_A_SOLUTION, axis=0)
    parameters[:, 3:5], parameters[:, -1] = (5.0, 30.0), 0.0
    return Kind(
        name,
        len(parameters),
        lambda mode, i: recorded_press(
            tables, parameters[i], mode, press_seed(seed, i), levels=ErrorLevels(), ramps=ramps[i // SKINS_A_SOLUTION]
        ),
    )


def outside_chapter(answer: EstimateOf, kinds: Sequence[Kind], *, jobs: int = -1) -> Chapter:
    """Return the share of refused presses of each kind in each mode; the first kind is the ordinary one.

    Mode quick is shown and not judged: at one force some of these cannot be told from an inclusion.
    """
    benchmarks = []
    for mode in RAMP_MODES:
        for number, kind in enumerate(kinds):
            case, share = (
                f"{mode}, {_spoken(kind)}",
                refused_share(answer, kind, mode, counts_unseen=number > 0, jobs=jobs),
            )
            benchmark = (
                at_least(case, SHARE, share, REFUSED_AT_LEAST) if number else at_most(case, SHARE, share, FALSE_AT_MOST)
            )
            benchmarks.append(benchmark)
    quick = tuple(
        (_spoken(kind), f"{refused_share(answer, kind, 'quick', counts_unseen=number > 0, jobs=jobs):.0%}")
        for number, kind in enumerate(kinds)
    )
    return Chapter(
        title="What is not one round inclusion gets no numbers",
        claim=(
            "Each press is refused for its misfit, its elongation, the odds of a size or depth outside its range, or "
            "because nothing stands out."
        ),
        source="device/measurement/ramp_modes/estimate.py, held_estimate.py; host_tools/scores/outside.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("Mode quick", ("presses", SHARE), quick),),
    )


def refused_share(answer: EstimateOf, kind: Kind, mode: Mode, *, counts_unseen: bool = True, jobs: int = -1) -> float:
    """Return the share of a kind's presses that a mode refuses.

    An inclusion that does not stand out gets no numbers either; with `counts_unseen` false such presses are left out.
    """
    estimates = in_parallel(lambda i: answer(kind.record(mode, i), mode), kind.count, jobs)
    refused = [one.size_mm.value is None for one in estimates if counts_unseen or not _is_unseen(one)]
    return float(np.mean(refused)) if refused else float("nan")


def _is_unseen(estimate: Estimate) -> bool:
    return estimate.size_mm.value is None and estimate.status == "not_identifiable"


def _spoken(kind: Kind) -> str:
    return f"{kind.name} ({kind.count})"
