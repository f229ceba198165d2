"""How often the ramp modes refuse ellipsoids that are longer than wide, beside how often any test could.

Spheres solved in the same way are the control: a lump is not to be called oblong because it was solved otherwise than
those that the modes were trained on.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from host_tools.study.just_outside import FALSE_FLAGS, Twin
from host_tools.study.mode_outside import REFUSED_AT_LEAST, SHARE, Answer
from host_tools.study.oblong_lumps import Oblong, draw_oblong, nearest_round_twin, spoken

ELLIPSOIDS, SPHERES, SKINS = 30, 10, 4
"""Lumps that are solved, and presses of each, on other skins and tissue and tilted otherwise."""
CLAIM = (
    f"{ELLIPSOIDS} random ellipsoids 1.6-2.4 times as long as wide and high, 5-10 mm wide, 4-7 mm deep, 30-150 kPa, up "
    f"to 2 mm off the axis, their long axis along or across the offset; {SKINS} presses of each on other skins, with "
    "every drift. A press is as far from its nearest round twin inside the ranges as it says, profile and second "
    "harmonics together, on nominal tissue: what lies closer than some four standard deviations no test can tell from "
    f"round in {REFUSED_AT_LEAST:.0%} of presses when it may flag {FALSE_FLAGS:.2%} of the round ones. Judged are the "
    "ellipsoids that the best test could; it knows the twin and the ellipsoid, while the probe knows neither. "
    f"The {SPHERES} spheres are solved as the ellipsoids are: they are to be answered."
)
HEADER = ("mode", "width (mm)", "depth (mm)", "modulus (kPa)", "times as long", "off the axis (mm)", "long axis",
          "deviations apart", "most that any test can flag", "refused")  # fmt: skip


def oblong_chapter(answer: Answer, model: ProfileModel, tables: ProbeTables, *, jobs: int = -1) -> Chapter:
    """Return how often each ellipsoid, and each sphere, is refused; mode quick is shown and not judged."""
    seed = derived_seed(1, "oblong")
    rng = np.random.default_rng(seed)
    lumps = draw_oblong(ELLIPSOIDS, SPHERES, rng)
    solved = in_parallel(lambda i: lumps[i].on(tables), len(lumps), jobs)
    press = partial(_is_refused, answer, solved, skins(lumps, rng), seed)
    benchmarks: list[Benchmark] = []
    rows: list[tuple[str, ...]] = []
    sums: list[tuple[str, ...]] = []
    for mode in RAMP_MODES:
        refused = refused_of_each(partial(press, mode), len(lumps), jobs)
        twins = in_parallel(partial(_twin, lumps, solved, model, mode), ELLIPSOIDS, jobs)
        could = np.array([twin.most_flagged() for twin in twins])
        benchmarks.append(_judged(mode, could, refused))
        rows += [_row(mode, *each) for each in zip(lumps, twins, refused, strict=False)]
        sums.append(_sum(mode, refused, f"{could.mean():.1%}"))
    sums.append(_sum("quick", refused_of_each(partial(press, "quick"), len(lumps), jobs), "-"))
    return Chapter(
        title="Lumps that are not round",
        claim=CLAIM,
        source="Neyman & Pearson, Phil. Trans. R. Soc. A 231 (1933); device/measurement/round_spot.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("All of them", SUMMARY, tuple(sums)), Table("Each ellipsoid", HEADER, tuple(rows))),
    )


def refused_of_each(is_refused: Callable[[int], bool], lumps: int, jobs: int) -> Array:
    """Return the refused share [n] of the presses of each lump."""
    refused = np.array(in_parallel(is_refused, SKINS * lumps, jobs), float)
    return np.asarray(refused.reshape(lumps, SKINS).mean(axis=1))


def skins(lumps: Sequence[Oblong], rng: np.random.Generator) -> Array:
    """Return parameters [n, 9] of `SKINS` presses of each lump; the solved field itself holds the offset."""
    parameters = draw_parameters(SKINS * len(lumps), rng)
    parameters[:, :3] = np.repeat([lump.inclusion.as_tuple() for lump in lumps], SKINS, axis=0)
    parameters[:, -1] = 0.0
    return parameters


SUMMARY = ("mode", f"ellipsoids refused ({SKINS * ELLIPSOIDS})", "most that any test can flag",
           f"spheres refused ({SKINS * SPHERES})")  # fmt: skip


def _judged(mode: Mode, could: Array, refused: Array) -> Benchmark:
    """Return the benchmark of the ellipsoids that the best test flags nearly always; NaN, which fails, without any."""
    judged = could >= REFUSED_AT_LEAST
    share = float(refused[: len(could)][judged].mean()) if judged.any() else float("nan")
    case = f"{mode}, ellipsoids that a test could tell ({SKINS * int(judged.sum())})"
    return at_least(case, SHARE, share, REFUSED_AT_LEAST)


def _sum(mode: Mode, refused: Array, could: str) -> tuple[str, ...]:
    """Return the shares of all ellipsoids and of the spheres after them, as table cells."""
    return mode, f"{refused[:ELLIPSOIDS].mean():.1%}", could, f"{refused[ELLIPSOIDS:].mean():.1%}"


def _is_refused(
    answer: Answer, solved: Sequence[ProbeTables], parameters: Array, seed: int, mode: Mode, number: int
) -> bool:
    of_press = press_seed(seed, number)
    recording = recorded_press(solved[number // SKINS], parameters[number], mode, of_press, levels=ErrorLevels())
    return answer(recording, mode).size_mm.value is None


def _twin(lumps: Sequence[Oblong], solved: Sequence[ProbeTables], model: ProfileModel, mode: Mode, number: int) -> Twin:
    return nearest_round_twin(lumps[number], solved[number], model, mode, seed=number)


def _row(mode: Mode, lump: Oblong, twin: Twin, refused: float) -> tuple[str, ...]:
    return mode, *spoken(lump), f"{twin.deviations:.1f}", f"{twin.most_flagged():.0%}", f"{refused:.0%}"
