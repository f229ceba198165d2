"""Presses that are not of one inclusion inside the trained ranges, and ordinary ones, to be recorded.

Skin, tissue and slab are random for all of them. Large lumps and shallow ones are not in the virtual probe's tables and
are solved by finite elements, each on its own. Lumps that are not round: `mode_oblong`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from device.measurement.mode import Mode
from device.measurement.press_noise import ErrorLevels
from device.measurement.quantities import Inclusion
from device.measurement.recording import Recording
from device.simulation.neighbour import Neighbour
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.press_samples import Array, draw_parameters
from host_tools.inverse.recorded_presses import in_parallel, recorded_press
from host_tools.inverse.seeds import press_seed
from host_tools.scene import Scene
from host_tools.surface_table import press_ramps

ORDINARY, PRESSES, SOLVED = 600, 40, 5
"""So many ordinary ones tell a share of 4 % to 0.8 %."""
SKINS_A_SOLUTION = 5
"""Presses of each solved lump, on other skins."""
CLEAR_SIZE_MM, CLEAR_DEPTH_MM, CLEAR_KPA = (5.0, 10.0), (4.0, 7.0), (30.0, 150.0)
"""Lumps that show well, so that it is their company or shape that must be noticed."""
GAP_MM, WET_RATIO = (0.5, 4.0), (0.1, 0.6)
LARGE_MM, SHALLOW_MM = (17.5, 20.0), (2.5, 3.2)

Record = Callable[[Mode, int], Recording]
Ends = tuple[float, float]


@dataclass(frozen=True)
class Kind:
    """One kind of press: how many there are, and what records the one of a number in a mode."""

    name: str
    count: int
    record: Record


def kinds(tables: ProbeTables, seed: int, jobs: int = -1) -> list[Kind]:
    """Return ordinary presses first, then those that are to be refused; some solves run here."""
    rng = np.random.default_rng(seed)
    record = partial(recorded_press, levels=ErrorLevels())
    ordinary, none, two, wet = (draw_parameters(count, rng) for count in (ORDINARY, PRESSES, PRESSES, PRESSES))
    none[:, 0] = 0.0
    two[:, :3] = clear_lumps(len(two), rng)
    neighbours = [_beside(one, rng) for one in two]
    wet_ratios = rng.uniform(*WET_RATIO, len(wet))

    def simple(parameters: Array) -> Record:
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


def clear_lumps(count: int, rng: np.random.Generator) -> Array:
    """Return size, depth and modulus [count, 3] of lumps that show well."""
    return _lumps(count, rng, CLEAR_SIZE_MM, CLEAR_DEPTH_MM)


def _lumps(count: int, rng: np.random.Generator, sizes_mm: Ends, depths_mm: Ends) -> Array:
    """Return size, depth and modulus [count, 3]."""
    return np.column_stack([rng.uniform(low, high, count) for low, high in (sizes_mm, depths_mm, CLEAR_KPA)])


def _beside(first: Array, rng: np.random.Generator) -> Neighbour:
    size_mm, depth_mm, modulus_kpa = map(float, clear_lumps(1, rng)[0])
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
    lumps = _lumps(SOLVED, rng, sizes_mm, depths_mm)
    ramps = in_parallel(lambda i: press_ramps(Scene(Inclusion(*map(float, lumps[i])))), SOLVED, jobs)
    parameters = draw_parameters(SOLVED * SKINS_A_SOLUTION, rng)
    parameters[:, :3] = np.repeat(lumps, SKINS_A_SOLUTION, axis=0)
    parameters[:, 3:5], parameters[:, -1] = (5.0, 30.0), 0.0
    return Kind(
        name,
        len(parameters),
        lambda mode, i: recorded_press(
            tables, parameters[i], mode, press_seed(seed, i), levels=ErrorLevels(), ramps=ramps[i // SKINS_A_SOLUTION]
        ),
    )
