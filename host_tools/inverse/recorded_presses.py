"""Random presses as the probe records them: unknowns and nuisances to frames, and these to what a mode reads of them.

Frames, hand and cell are those of `host_tools phantom`; light and cell drift as `drifted_recording` says.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from joblib import Parallel, delayed

from device.measurement.mode import FRAMES, RAMP_FROM_N, RAMP_TO_N, Mode
from device.measurement.press_noise import ErrorLevels
from device.measurement.press_parameters import PARAMETERS
from device.measurement.press_profile import press_profile
from device.measurement.quantities import Inclusion
from device.measurement.recording import Recording
from device.simulation.neighbour import Neighbour
from device.simulation.pressed_face import Placement
from device.simulation.scenario import Scenario
from device.simulation.skin import Skin
from device.simulation.surface_table import PressRamps
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.drifted_recording import drifted
from host_tools.inverse.press_samples import Array
from host_tools.inverse.seeds import press_seed
from host_tools.phantom import TARGET_N, Protocol, phantom_recording

Result = TypeVar("Result")

HELD_STRAY_N = 0.0125
"""Frames of a hold may lie within 5 % of 0.5 N (`press.band_ratio`): spread over that band, twice this each way."""

EXACT = ErrorLevels(gain_ratio=0.0, zero_n=0.0, flat_field_ratio=0.0, model_ratio=0.0)


@dataclass(frozen=True, eq=False)
class RecordedPresses:
    """Parameters [n, 9], profile rows [n, P] and second harmonics [n, 2, K, J - 2] of recorded presses."""

    parameters: Array
    rows: Array
    second_harmonics: Array


def scenario_of(parameters: Array, neighbour: Neighbour | None = None, wet_ratio: float = 0.0) -> Scenario:
    """Return what the probe is pressed on, but for the inclusion, for parameters [9]."""
    at = dict(zip(PARAMETERS, map(float, parameters), strict=True))
    skin = Skin(
        albedo=at["albedo"],
        spread_mm=at["spread_mm"],
        contact_pressure_kpa=at["contact_pressure_kpa"],
        wet_ratio=wet_ratio,
    )
    return Scenario(
        skin=skin,
        tissue_modulus_kpa=at["tissue_modulus_kpa"],
        slab_thickness_mm=at["slab_thickness_mm"],
        neighbour=neighbour,
    )


def protocol_of(mode: Mode, offset_mm: float, angle_rad: float) -> Protocol:
    """Return the forces and the place of a press in a mode."""
    place = Placement(offset_mm * float(np.cos(angle_rad)), offset_mm * float(np.sin(angle_rad)))
    count = FRAMES[mode].count
    if FRAMES[mode].is_ramp:
        return Protocol(tuple(np.linspace(RAMP_FROM_N, RAMP_TO_N, count)), frames=1, place=place)
    return Protocol((TARGET_N,), frames=count, place=place, stray_n=HELD_STRAY_N)


def recorded_press(
    tables: ProbeTables,
    parameters: Array,
    mode: Mode,
    seed: int,
    *,
    levels: ErrorLevels = EXACT,
    neighbour: Neighbour | None = None,
    wet_ratio: float = 0.0,
    ramps: PressRamps | None = None,
) -> Recording:
    """Return the recording of one press with parameters [9], in the frames that a mode takes.

    `neighbour` is a second inclusion, `wet_ratio` the share of the face under gel; `ramps` say how the face deforms
    where the tables do not.
    """
    rng = np.random.default_rng([seed, 1])
    inclusion = Inclusion(*map(float, parameters[:3]))
    protocol = protocol_of(mode, float(parameters[-1]), rng.uniform(0, 2 * np.pi))
    scenario = scenario_of(parameters, neighbour, wet_ratio)
    recording = phantom_recording(inclusion, tables, seed=seed, protocol=protocol, scenario=scenario, ramps=ramps)
    return recording if levels == EXACT else drifted(recording, rng, levels)


def record_presses(
    tables: ProbeTables, parameters: Array, mode: Mode, *, seed: int, levels: ErrorLevels = EXACT, jobs: int = -1
) -> RecordedPresses:
    """Return rows and second harmonics of presses with parameters [n, 9] in a ramp mode; the same whatever `jobs`."""

    def read(number: int) -> tuple[Array, Array]:
        recording = recorded_press(tables, parameters[number], mode, press_seed(seed, number), levels=levels)
        profile = press_profile(recording)
        return profile.as_row(), profile.second_harmonic

    rows, second_harmonics = zip(*in_parallel(read, len(parameters), jobs), strict=True)
    return RecordedPresses(parameters, np.array(rows), np.array(second_harmonics))


def in_parallel(work: Callable[[int], Result], count: int, jobs: int) -> list[Result]:
    """Return the results of `work` on 0 to `count` - 1, one thread a process."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    return list(Parallel(n_jobs=jobs, batch_size=4)(delayed(work)(number) for number in range(count)))
