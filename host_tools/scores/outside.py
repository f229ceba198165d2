"""How often the modes refuse presses that are not of one round inclusion inside the trained ranges.

Skin, tissue and slab are random for all of them. Large inclusions and shallow ones are not in the virtual probe's
tables and are solved by finite elements, each on its own. Inclusions that are not round: `ellipsoids`. The refusals of
ordinary presses are the false ones. A scan may also meet an inclusion that gives way: its later ramps are of another
depth. Where it only slips aside nothing is wrong, since every ramp's offset is unknown. All are recorded through the
simulated camera with every drift, and answered as the device answers them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from device.measurement.arrays import Array
from device.measurement.estimate import Estimate
from device.measurement.mode import FRAMES, Mode
from device.measurement.parameters import COUNT, RANGES, Range
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.model import RAMP_MODES
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.recording.recording import Recording
from device.simulation.physics.neighbour import Neighbour
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Chapter, Table, at_least, at_most
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.ramp_training import further_offsets_mm
from host_tools.press_models.recorded_presses import in_parallel, recorded_press
from host_tools.press_models.seeds import press_seed
from host_tools.probe_tables.force_ramps import press_ramps
from host_tools.scenes.scene import Scene

ALL_MODES: tuple[Mode, ...] = ("standard", "quick", "precise")
ORDINARY_KIND = "ordinary"
ORDINARY, PRESSES, SOLVED = 600, 40, 5
"""So many ordinary ones tell a share of 4 % to 0.8 %."""
SKINS_A_SOLUTION = 5
"""Presses of each solved inclusion, on other skins."""
CLEAR_SIZE_MM, CLEAR_DEPTH_MM, CLEAR_KPA = (5.0, 10.0), (4.0, 7.0), (30.0, 150.0)
"""Inclusions that show well, so that it is their company or shape that must be noticed."""
GAP_MM, WET_RATIO = (0.5, 4.0), (0.1, 0.6)
LARGE_MM, SHALLOW_MM = (17.5, 20.0), (2.5, 3.2)
SUNK_MM = (1.5, 3.0)
"""So much deeper does an inclusion lie after the first ramp that gives way."""
RecordPress = Callable[[Mode, int], Recording]
SHARE = "share refused"
CLEAR_IN = RANGES | {"tissue_modulus_kpa": Range(2.5, 23.0, True), "slab_thickness_mm": Range(21.0, 60.0, True)}
"""Tissue in which each of these is possible, sunk too."""
REFUSED_AT_LEAST, FALSE_AT_MOST = 0.95, 0.05
EstimateOf = Callable[[Recording, Mode], Estimate]


@dataclass(frozen=True)
class Kind:
    """One kind of press: how many there are, and what records the one of a number in a mode."""

    name: str
    count: int
    record: RecordPress
    modes: tuple[Mode, ...] = ("standard", "quick")


def kinds(tables: ProbeTables, seed: int, jobs: int = -1) -> list[Kind]:
    """Return ordinary presses first, then those that are to be refused; some solves run here."""
    rng = np.random.default_rng(seed)
    ordinary, none, wet = (draw_parameters(count, rng) for count in (ORDINARY, PRESSES, PRESSES))
    none[:, 0] = 0.0
    two = draw_clear(PRESSES, rng)
    further_mm = further_offsets_mm(ORDINARY, np.random.default_rng([seed, 1]))

    def record(tables: ProbeTables, parameters: Array, mode: Mode, number: int, **others: Any) -> Recording:
        places = further_mm[number] if FRAMES[mode].is_scan else ()
        own = press_seed(seed, number)
        return recorded_press(tables, parameters, mode, own, levels=ErrorLevels(), further_mm=places, **others)

    neighbours = [neighbour_beside(one, rng) for one in two]
    wet_ratios = rng.uniform(*WET_RATIO, len(wet))
    firm, sunk = np.array(two), np.array(two)
    sunk[:, 1] += np.random.default_rng([seed, 2]).uniform(*SUNK_MM, len(sunk))

    def simple(parameters: Array) -> RecordPress:
        return lambda mode, i: record(tables, parameters[i], mode, i)

    return [
        Kind(ORDINARY_KIND, ORDINARY, simple(ordinary), ALL_MODES),
        Kind("no inclusion", PRESSES, simple(none), ALL_MODES),
        Kind(
            "two inclusions",
            PRESSES,
            lambda mode, i: record(tables, two[i], mode, i, neighbour=neighbours[i]),
            ALL_MODES,
        ),
        Kind(
            "gel on the face",
            PRESSES,
            lambda mode, i: record(tables, wet[i], mode, i, wet_ratio=float(wet_ratios[i])),
            ALL_MODES,
        ),
        Kind(
            "an inclusion that gives way",
            PRESSES,
            lambda mode, i: _given_way(*(record(tables, one[i], mode, i) for one in (firm, sunk))),
            ("precise",),
        ),
        _solved("larger than trained (17.5-20 mm)", tables, LARGE_MM, CLEAR_DEPTH_MM, rng, seed, jobs),
        _solved("shallower than trained (2.5-3.2 mm)", tables, CLEAR_SIZE_MM, SHALLOW_MM, rng, seed, jobs),
    ]


def _given_way(before: Recording, after: Recording) -> Recording:
    """Return a scan whose first ramp is of one recording, and whose others are of the other with the same drifts."""
    later = [frame for frame in after.frames if frame.role == "press" and frame.ramp]
    return replace(before, frames=(*(one for one in before.frames if one.role != "press" or not one.ramp), *later))


def draw_clear(count: int, rng: np.random.Generator) -> Array:
    """Return parameters [count, 9] of inclusions that show well."""
    parameters = draw_parameters(count, rng, ranges=CLEAR_IN)
    parameters[:, :COUNT] = clear_inclusions(count, rng)
    return parameters


def clear_inclusions(count: int, rng: np.random.Generator) -> Array:
    """Return size, depth and modulus [count, 3] of inclusions that show well."""
    return _inclusions(count, rng, CLEAR_SIZE_MM, CLEAR_DEPTH_MM)


def _inclusions(
    count: int, rng: np.random.Generator, sizes_mm: tuple[float, float], depths_mm: tuple[float, float]
) -> Array:
    """Return size, depth and modulus [count, 3]."""
    return np.column_stack([rng.uniform(low, high, count) for low, high in (sizes_mm, depths_mm, CLEAR_KPA)])


def neighbour_beside(first: Array, rng: np.random.Generator) -> Neighbour:
    """Return an inclusion that shows well beside a first one, whose diameter (mm) its parameters begin with."""
    size_mm, depth_mm, modulus_kpa = map(float, clear_inclusions(1, rng)[0])
    away_mm, angle = (first[0] + size_mm) / 2 + rng.uniform(*GAP_MM), rng.uniform(0, 2 * np.pi)
    return Neighbour(size_mm, depth_mm, modulus_kpa, float(away_mm * np.cos(angle)), float(away_mm * np.sin(angle)))


def _solved(
    name: str,
    tables: ProbeTables,
    sizes_mm: tuple[float, float],
    depths_mm: tuple[float, float],
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
    """Return the share of refused presses of each kind in modes standard and precise; ordinary ones are the false.

    Mode quick is shown and not judged: at one force some of these cannot be told from an inclusion.
    """
    benchmarks = []
    for mode in RAMP_MODES:
        for kind in kinds:
            if mode in kind.modes:
                case, share = f"{mode}, {_spoken(kind)}", _refused(answer, kind, mode, jobs)
                bound = at_most(case, SHARE, share, FALSE_AT_MOST), at_least(case, SHARE, share, REFUSED_AT_LEAST)
                benchmarks.append(bound[kind.name != ORDINARY_KIND])
    quick = tuple(
        (_spoken(kind), f"{_refused(answer, kind, 'quick', jobs):.0%}") for kind in kinds if "quick" in kind.modes
    )
    return Chapter(
        title="What is not one round inclusion gets no numbers",
        claim=(
            "Each press is refused for its misfit, its elongation, its tissue, the odds of a size or depth outside its "
            "range, or because nothing stands out; mode quick has two tests of its own."
        ),
        source="device/measurement/ramp_modes/estimate.py, device/measurement/quick_mode/model.py; "
        "host_tools/scores/outside.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("Mode quick", ("presses", SHARE), quick),),
    )


def _refused(answer: EstimateOf, kind: Kind, mode: Mode, jobs: int) -> float:
    return refused_share(answer, kind, mode, counts_unseen=kind.name != ORDINARY_KIND, jobs=jobs)


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
