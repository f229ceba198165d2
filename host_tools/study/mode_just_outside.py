"""The chapter on lumps just outside the trained ranges: refused, answered with the truth in the interval, or misled.

Where the nearest lump inside can be told from them at all, they ought to be refused; where not, nobody can.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate
from device.measurement.fit_press import PressPosterior
from device.measurement.mode import Mode
from device.measurement.press_noise import ErrorLevels
from device.measurement.profile_estimate import estimate_profile
from device.measurement.profile_model import RAMP_MODES, ProfileModel
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.simulation.surface_table import PressRamps
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.press_samples import profile_rows
from host_tools.inverse.recorded_presses import in_parallel, recorded_press
from host_tools.inverse.seeds import derived_seed, press_seed
from host_tools.study.benchmark import Benchmark, Chapter, Table, at_least
from host_tools.study.just_outside import FALSE_FLAGS, LUMPS, Twin, at_nominal, holds, lump_ramps, nearest_twin, spoken
from host_tools.study.mode_outside import FALSE_AT_MOST, REFUSED_AT_LEAST, SHARE

PRESSES = 10
CLAIM = (
    f"{PRESSES} recordings of each lump, nominal tissue and skin, with every drift. A press is as far from its nearest "
    "twin inside the ranges, whatever tissue and skin that one has, as it says: standard deviations of all that noise "
    f"and drift leave unknown. Three doubts - misfit, elongation and this one - share the {FALSE_AT_MOST:.0%} of false "
    f"flags that a mode may have, so each may flag {FALSE_FLAGS:.2%} of the presses inside. The best test that flags "
    "as many of the twin's presses flags at most the share beside it: no refusal is asked for where that is below "
    f"{REFUSED_AT_LEAST:.0%}. Beside that stands what it could flag if all {FALSE_AT_MOST:.0%} were its own. (Where "
    "more is refused, the twin lies at the very end of a range and is refused more often than others, too.) What is "
    "answered there is the twin's answer; an interval that ends with the range is open and holds all beyond. Size and "
    "depth are told by networks that have seen lumps around the ranges; a modulus outside is not looked for, since "
    "hardly any could be told."
)
HEADER = ("mode", "size (mm)", "depth (mm)", "modulus (kPa)", "looks like: size", "depth", "modulus",
          "deviations apart", "most that any test can flag", "if all false flags were its own", "refused",
          "of the others: size holds", "depth holds", "modulus holds")  # fmt: skip


def just_outside_chapter(
    model: ProfileModel, calibration: Calibration, tables: ProbeTables, *, jobs: int = -1
) -> Chapter:
    """Return how alike to a lump inside, and how often refused, each of `LUMPS` is in standard and precise."""
    ramps = in_parallel(lambda i: lump_ramps(tables, LUMPS[i]), len(LUMPS), jobs)
    seed = derived_seed(1, "just outside")
    benchmarks: list[Benchmark] = []
    rows: list[tuple[str, ...]] = []
    for mode in RAMP_MODES:
        twins = in_parallel(partial(_twin, model, mode, tables, ramps), len(LUMPS), jobs)
        press = partial(_press, model, calibration, tables, mode, ramps, seed)
        found = in_parallel(press, PRESSES * len(LUMPS), jobs)
        for number, (lump, twin) in enumerate(zip(LUMPS, twins, strict=True)):
            of_one = found[PRESSES * number : PRESSES * (number + 1)]
            benchmarks += _judged(mode, lump, twin, of_one)
            rows.append(_row(mode, lump, twin, of_one))
    return Chapter(
        title="Just outside the trained ranges",
        claim=CLAIM,
        source="Neyman & Pearson, Phil. Trans. R. Soc. A 231 (1933); host_tools/study/just_outside.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("Each lump", HEADER, tuple(rows)),),
    )


def _twin(model: ProfileModel, mode: Mode, tables: ProbeTables, ramps: Sequence[PressRamps], number: int) -> Twin:
    row = profile_rows(tables, at_nominal(LUMPS[number])[None], ramps=ramps[number])[0]
    return nearest_twin(PressPosterior(row, model.answers.surrogate, model.answers.noise[mode]), seed=number)


def _press(
    model: ProfileModel,
    calibration: Calibration,
    tables: ProbeTables,
    mode: Mode,
    ramps: Sequence[PressRamps],
    seed: int,
    number: int,
) -> Estimate:
    lump = number // PRESSES
    at, of_press = at_nominal(LUMPS[lump]), press_seed(seed, number)
    recording = recorded_press(tables, at, mode, of_press, levels=ErrorLevels(), ramps=ramps[lump])
    return estimate_profile(recording, mode, model, calibration)


def _judged(mode: Mode, lump: Inclusion, twin: Twin, found: Sequence[Estimate]) -> list[Benchmark]:
    if twin.most_flagged() < REFUSED_AT_LEAST:
        return []
    case = "{}, {} mm, {} mm deep, {} kPa".format(mode, *spoken(lump))
    return [at_least(case, SHARE, _refused(found), REFUSED_AT_LEAST)]


def _refused(found: Sequence[Estimate]) -> float:
    return float(np.mean([one.size_mm.value is None for one in found]))


def _row(mode: Mode, lump: Inclusion, twin: Twin, found: Sequence[Estimate]) -> tuple[str, ...]:
    answered = [one for one in found if one.size_mm.value is not None]
    held = [[holds(getattr(one, name), getattr(lump, name)) for one in answered] for name in UNKNOWNS]
    shares = (f"{np.mean(of_unknown):.0%}" if of_unknown else "-" for of_unknown in held)
    most = f"{twin.deviations:.1f}", f"{twin.most_flagged():.0%}", f"{twin.most_flagged(FALSE_AT_MOST):.0%}"
    return mode, *spoken(lump), *spoken(twin.inclusion), *most, f"{_refused(found):.0%}", *shares
