"""Inclusions just outside the trained ranges: how like one inside they look, and what the modes make of them.

An image that some inclusion inside explains as well as the noise lets one see cannot be flagged by any test. How well
that is possible is the distance of the press without noise from its nearest inclusion inside, whatever tissue and skin
that one has. Source: Neyman & Pearson, Phil. Trans. R. Soc. A 231 (1933): the best test between two means d standard
deviations apart has the power Phi(d - z).

Where the nearest inclusion inside can be told from them at all, they ought to be refused; where not, nobody can. The
chapter counts those refused, answered with the truth in the interval, and misled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import norm

from device.measurement.arrays import Array
from device.measurement.calibration import Calibration
from device.measurement.estimate import Estimate, Quantity
from device.measurement.mode import Mode
from device.measurement.parameters import HIGH, LOW, NOMINAL, PARAMETERS, denormalise
from device.measurement.quantities import UNKNOWNS, Inclusion
from device.measurement.ramp_modes.estimate import estimate_ramp
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.model import RampModel
from device.measurement.ramp_modes.noise import ErrorLevels
from device.simulation.physics.surface_table import PressRamps, Ramp
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least
from host_tools.press_models.mode_outcome import CRITICAL_RATIO
from host_tools.press_models.press_samples import profile_rows
from host_tools.press_models.recorded_presses import in_parallel, recorded_press
from host_tools.press_models.seeds import derived_seed, press_seed
from host_tools.probe_tables.force_ramps import press_ramps
from host_tools.scenes.scene import Scene
from host_tools.scores.outside import FALSE_AT_MOST, REFUSED_AT_LEAST, SHARE

FALSE_FLAGS = 1 - CRITICAL_RATIO
"""Share of presses inside that this test may flag: misfit and elongation flag as many each, all three at most 5 %."""
MODE: Mode = "standard"
"""A scan, which sees the inclusion from several sides, tells no less."""
STARTS = 6
"""Fits from as many places, of which the best one counts."""
INCLUSIONS = (
    Inclusion(16.0, 6.0, 60.0),
    Inclusion(17.0, 6.0, 60.0),
    Inclusion(1.6, 4.2, 80.0),
    Inclusion(7.0, 3.6, 60.0),
    Inclusion(7.0, 3.2, 60.0),
    Inclusion(12.0, 13.0, 80.0),
    Inclusion(14.0, 14.5, 80.0),
    Inclusion(12.0, 16.5, 80.0),
    Inclusion(9.0, 5.0, 8.0),
    Inclusion(9.0, 5.0, 6.8),
    Inclusion(9.0, 5.0, 300.0),
    Inclusion(14.0, 4.5, 300.0),
)
"""Each outside in one of size, depth and modulus."""
PRESSES = 10
CLAIM = f"{PRESSES} recordings of each inclusion, nominal tissue and skin, with every drift."
HEADER = ("mode", "size (mm)", "depth (mm)", "modulus (kPa)", "looks like: size", "depth", "modulus",
          "deviations apart", "most that any test can flag", "if all false flags were its own", "refused",
          "of the others: size holds", "depth holds", "modulus holds")  # fmt: skip


@dataclass(frozen=True)
class NearestInside:
    """The inclusion inside the ranges that looks most like one outside, and their distance in standard deviations."""

    inclusion: Inclusion
    deviations: float

    def most_flagged(self, false_flags: float = FALSE_FLAGS) -> float:
        """Return the largest share that any test can flag of the one, when it flags `false_flags` of the other."""
        return float(norm.cdf(self.deviations - norm.isf(false_flags)))


def at_nominal(inclusion: Inclusion) -> Array:
    """Return the parameters [9] of an inclusion on the axis, below the nominal tissue and skin."""
    at = {**NOMINAL, **vars(inclusion)}
    return np.array([at[name] for name in PARAMETERS])


def inclusion_ramps(tables: ProbeTables, inclusion: Inclusion) -> PressRamps:
    """Return the ramps of an inclusion in the nominal slab: from the tables, or solved where they end.

    The ramp beside a solved inclusion is the tables' own, so that nothing but the inclusion tells it from theirs.
    """
    size_mm, depth_mm, modulus_kpa = inclusion.as_tuple()
    inside_mm = np.clip([size_mm, depth_mm], LOW[:2], HIGH[:2])
    own = tables.centred.ramps(Inclusion(float(inside_mm[0]), float(inside_mm[1]), modulus_kpa))
    if np.array_equal(inside_mm, [size_mm, depth_mm]):
        return own
    solved = press_ramps(Scene(inclusion))
    fields = [[np.interp(solved.r_mm, own.r_mm, of_load) for of_load in field] for field in own.baseline.fields_per_n]
    return PressRamps(solved.r_mm, Ramp(own.baseline.force_n, np.array(fields)), solved.inclusion_field)


def nearest_inside(posterior: PressPosterior, seed: int) -> NearestInside:
    """Return what inside the ranges looks most like a press without noise."""
    starts = np.random.default_rng(seed).uniform(-0.9, 0.9, (STARTS, len(PARAMETERS)))

    def jacobian(normalised: Array) -> Array:
        return np.asarray(posterior.residuals_and_jacobian(normalised[None])[1][0])

    fits = [
        least_squares(posterior.residuals, start, jac=jacobian, bounds=(-1.0, 1.0), xtol=1e-7, ftol=1e-7)
        for start in starts
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    return NearestInside(Inclusion(*map(float, denormalise(best.x)[:3])), float(np.sqrt(2 * best.cost)))


def holds(quantity: Quantity, truth: float) -> bool:
    """Return whether an interval holds the truth; an open end holds all that lies beyond it."""
    if quantity.low is None or quantity.high is None:
        return False
    return (quantity.low_is_open or quantity.low <= truth) and (quantity.high_is_open or truth <= quantity.high)


def spoken(inclusion: Inclusion) -> Sequence[str]:
    """Return size, depth and modulus as table cells."""
    return f"{inclusion.size_mm:.3g}", f"{inclusion.depth_mm:.3g}", f"{inclusion.youngs_modulus_kpa:.3g}"


def just_outside_chapter(model: RampModel, calibration: Calibration, tables: ProbeTables, *, jobs: int = -1) -> Chapter:
    """Return how like one inside each of `INCLUSIONS` looks, and how often mode standard refuses it."""
    ramps = in_parallel(lambda i: inclusion_ramps(tables, INCLUSIONS[i]), len(INCLUSIONS), jobs)
    seed = derived_seed(1, "just outside")
    nearest_ones = in_parallel(partial(_nearest, model, tables, ramps), len(INCLUSIONS), jobs)
    press = partial(_press, model, calibration, tables, ramps, seed)
    found = in_parallel(press, PRESSES * len(INCLUSIONS), jobs)
    benchmarks: list[Benchmark] = []
    rows: list[tuple[str, ...]] = []
    for number, (inclusion, nearest) in enumerate(zip(INCLUSIONS, nearest_ones, strict=True)):
        of_one = found[PRESSES * number : PRESSES * (number + 1)]
        benchmarks += _benchmarks(inclusion, nearest, of_one)
        rows.append(_row(inclusion, nearest, of_one))
    return Chapter(
        title="Just outside the trained ranges",
        claim=CLAIM,
        source="Neyman & Pearson, Phil. Trans. R. Soc. A 231 (1933); host_tools/scores/just_outside.py",
        benchmarks=tuple(benchmarks),
        tables=(Table("Each inclusion", HEADER, tuple(rows)),),
        facts={
            "false_at_most": FALSE_AT_MOST,
            "false_flags": FALSE_FLAGS,
            "refused_at_least": REFUSED_AT_LEAST,
        },
    )


def _nearest(model: RampModel, tables: ProbeTables, ramps: Sequence[PressRamps], number: int) -> NearestInside:
    row = profile_rows(tables, at_nominal(INCLUSIONS[number])[None], ramps=ramps[number])[0]
    posterior = PressPosterior(row, model.answers.surrogate, model.answers.noise, direction_rad=np.zeros(1))
    return nearest_inside(posterior, seed=number)


def _press(
    model: RampModel,
    calibration: Calibration,
    tables: ProbeTables,
    ramps: Sequence[PressRamps],
    seed: int,
    number: int,
) -> Estimate:
    inclusion = number // PRESSES
    at, of_press = at_nominal(INCLUSIONS[inclusion]), press_seed(seed, number)
    recording = recorded_press(tables, at, MODE, of_press, levels=ErrorLevels(), ramps=ramps[inclusion])
    return estimate_ramp(recording, MODE, model, calibration)


def _benchmarks(inclusion: Inclusion, nearest: NearestInside, found: Sequence[Estimate]) -> list[Benchmark]:
    if nearest.most_flagged() < REFUSED_AT_LEAST:
        return []
    case = "{}, {} mm, {} mm deep, {} kPa".format(MODE, *spoken(inclusion))
    return [at_least(case, SHARE, _refused(found), REFUSED_AT_LEAST)]


def _refused(found: Sequence[Estimate]) -> float:
    return float(np.mean([one.size_mm.value is None for one in found]))


def _row(inclusion: Inclusion, nearest: NearestInside, found: Sequence[Estimate]) -> tuple[str, ...]:
    answered = [one for one in found if one.size_mm.value is not None]
    held = [[holds(getattr(one, name), getattr(inclusion, name)) for one in answered] for name in UNKNOWNS]
    shares = (f"{np.mean(of_unknown):.0%}" if of_unknown else "-" for of_unknown in held)
    most = f"{nearest.deviations:.1f}", f"{nearest.most_flagged():.0%}", f"{nearest.most_flagged(FALSE_AT_MOST):.0%}"
    return MODE, *spoken(inclusion), *spoken(nearest.inclusion), *most, f"{_refused(found):.0%}", *shares
