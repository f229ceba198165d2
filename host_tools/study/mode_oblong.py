"""How often the ramp modes refuse ellipsoids that are longer than wide, beside how often any test could."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from device.measurement.mode import Mode
from device.measurement.press_noise import ErrorLevels
from device.measurement.profile_model import RAMP_MODES, ProfileModel
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.press_samples import Array, draw_parameters
from host_tools.inverse.recorded_presses import in_parallel, recorded_press
from host_tools.inverse.seeds import derived_seed, press_seed
from host_tools.study.benchmark import Benchmark, Chapter, Table, at_least
from host_tools.study.mode_outside import FALSE_AT_MOST, REFUSED_AT_LEAST, SHARE, Answer
from host_tools.study.oblong_lumps import Oblong, draw_oblong, most_flagged, round_deviations, spoken

ELLIPSOIDS, SKINS = 40, 3
"""Lumps that are solved, and presses of each: on other skins and tissue, and turned otherwise under the camera."""
CLAIM = (
    f"{ELLIPSOIDS} random ellipsoids 1.6-2.4 times as long as wide and high, 5-10 mm wide, 4-7 mm deep, 30-150 kPa, up "
    f"to 2 mm off the axis, their long axis along or across the offset and turned at random under the camera; {SKINS} "
    "presses of each on other skin, tissue and slab, with every drift. Each is the probe's own sphere with what being "
    "longer adds to it. Each press without noise is as many standard deviations from the nearest round lump inside the "
    "ranges, profile and second harmonics together, as it says. What lies closer than some four no test can tell from "
    "round nearly always: the shares beside them are of the best test that treats all directions alike and flags "
    f"{FALSE_AT_MOST:.0%} of round lumps, all that a mode may. Judged are the presses of which it would flag "
    f"{REFUSED_AT_LEAST:.0%}; refused counts whatever the reason."
)
HEADER = ("mode", "width (mm)", "depth (mm)", "modulus (kPa)", "times as long", "off the axis (mm)", "long axis",
          "deviations apart", "most that a test can flag", "refused")  # fmt: skip
SUMMARY = ("mode", f"ellipsoids refused ({SKINS * ELLIPSOIDS})", "most that a test can flag")


def oblong_chapter(answer: Answer, model: ProfileModel, tables: ProbeTables, *, jobs: int = -1) -> Chapter:
    """Return how often presses of each ellipsoid are refused; mode quick is shown and not judged."""
    seed = derived_seed(1, "oblong")
    rng = np.random.default_rng(seed)
    lumps = draw_oblong(ELLIPSOIDS, rng)
    solved = in_parallel(lambda i: lumps[i].on(tables), len(lumps), jobs)
    parameters = skins(lumps, rng)
    press = partial(_is_refused, answer, solved, parameters, seed)
    benchmarks: list[Benchmark] = []
    rows: list[tuple[str, ...]] = []
    sums: list[tuple[str, ...]] = []
    for mode in RAMP_MODES:
        refused = np.array(in_parallel(partial(press, mode), len(parameters), jobs), float)
        apart = np.array(in_parallel(partial(_apart, solved, parameters, model, mode), len(parameters), jobs))
        benchmarks.append(_judged(mode, apart, refused))
        rows += _rows(mode, lumps, apart, refused)
        sums.append(_sum(mode, refused, apart))
    sums.append(_sum("quick", np.array(in_parallel(partial(press, "quick"), len(parameters), jobs), float)))
    return Chapter(
        title="Lumps that are not round",
        claim=CLAIM,
        source="Lehmann & Romano, Testing Statistical Hypotheses (2005), 6.3; device/measurement/round_spot.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("All of them", SUMMARY, tuple(sums)), Table("Each ellipsoid, means", HEADER, tuple(rows))),
    )


def skins(lumps: Sequence[Oblong], rng: np.random.Generator) -> Array:
    """Return parameters [n, 9] of `SKINS` presses of each lump."""
    parameters = draw_parameters(SKINS * len(lumps), rng)
    parameters[:, :3] = np.repeat([lump.inclusion.as_tuple() for lump in lumps], SKINS, axis=0)
    parameters[:, -1] = np.repeat([lump.offset_mm for lump in lumps], SKINS)
    return parameters


def _is_refused(
    answer: Answer, solved: Sequence[ProbeTables], parameters: Array, seed: int, mode: Mode, number: int
) -> bool:
    of_press = press_seed(seed, number)
    recording = recorded_press(solved[number // SKINS], parameters[number], mode, of_press, levels=ErrorLevels())
    return answer(recording, mode).size_mm.value is None


def _apart(solved: Sequence[ProbeTables], parameters: Array, model: ProfileModel, mode: Mode, number: int) -> float:
    return round_deviations(solved[number // SKINS], parameters[number], model, mode)


def _judged(mode: Mode, apart: Array, refused: Array) -> Benchmark:
    """Return the benchmark of the presses that a test flags nearly always; NaN, and failed, without any."""
    judged = most_flagged(apart, FALSE_AT_MOST) >= REFUSED_AT_LEAST
    share = float(refused[judged].mean()) if judged.any() else float("nan")
    case = f"{mode}, ellipsoids that a test could tell ({int(judged.sum())} presses)"
    return at_least(case, SHARE, share, REFUSED_AT_LEAST)


def _sum(mode: Mode, refused: Array, apart: Array | None = None) -> tuple[str, ...]:
    could = "-" if apart is None else f"{most_flagged(apart, FALSE_AT_MOST).mean():.1%}"
    return mode, f"{refused.mean():.1%}", could


def _rows(mode: Mode, lumps: Sequence[Oblong], apart: Array, refused: Array) -> list[tuple[str, ...]]:
    could = most_flagged(apart, FALSE_AT_MOST)
    means = zip(lumps, *(part.reshape(-1, SKINS).mean(axis=1) for part in (apart, could, refused)), strict=True)
    return [
        (mode, *spoken(lump), f"{deviations:.1f}", f"{most:.0%}", f"{share:.0%}")
        for lump, deviations, most, share in means
    ]
