"""How often mode standard refuses ellipsoids that are longer than wide, beside how often any test could.

What being longer adds to a sphere is solved by finite elements for each, its long axis along or across its offset,
and carried on to the probe's own sphere (`stretched_inclusion`). How far a press of it lies from its nearest round
inclusion inside the ranges - in the profile, which holds second harmonics, whatever tissue and skin that one has -
bounds any test that, as the probe, does not know which way an inclusion is longer.
Source: Lehmann & Romano, Testing Statistical Hypotheses (2005), 6.3: of tests that treat all directions alike the best
one rejects by the length, whose square is a noncentral chi-square of two degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import ncx2

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.parameters import HIGH, NEAR_NOMINAL, normalise
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.fit import PressPosterior, best_fit
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.surrogate import OFFSET
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least
from host_tools.press_models.press_samples import draw_around, profile_rows
from host_tools.press_models.recorded_presses import in_parallel, recorded_press
from host_tools.press_models.seeds import derived_seed, press_seed
from host_tools.probe_tables.ellipsoid import stretched_inclusion
from host_tools.scenes.scene import Placement, Scene
from host_tools.scores.outside import FALSE_AT_MOST, REFUSED_AT_LEAST, SHARE, EstimateOf, clear_inclusions

MODE: Mode = "standard"
QUICK: Mode = "quick"
WIDTH_RATIO = (1.6, 2.4)
ELLIPSOIDS, SKINS = 40, 3
"""Inclusions that are solved, and presses of each: on other skins and tissue, and turned otherwise under the camera."""
CLAIM = (
    f"{ELLIPSOIDS} random ellipsoids 1.6-2.4 times as long as wide and high, 5-10 mm wide, 4-7 mm deep, 30-150 kPa, up "
    f"to 2 mm off the axis; {SKINS} presses of each on other skin, tissue and slab, with every drift."
)
HEADER = ("mode", "width (mm)", "depth (mm)", "modulus (kPa)", "times as long", "off the axis (mm)", "long axis",
          "deviations apart", "most that a test can flag", "refused")  # fmt: skip
SUMMARY = ("mode", f"ellipsoids refused ({SKINS * ELLIPSOIDS})", "most that a test can flag")


@dataclass(frozen=True)
class Oblong:
    """An ellipsoid `width_ratio` times as long as wide and high, `offset_mm` off the axis."""

    inclusion: Inclusion
    width_ratio: float
    offset_mm: float
    is_across: bool

    def scene(self) -> Scene:
        """Return the scene to be solved."""
        x, y = (1.0, self.width_ratio) if self.is_across else (self.width_ratio, 1.0)
        return Scene(self.inclusion, placement=Placement(offset_x_mm=self.offset_mm, width_ratio_x=x, width_ratio_y=y))

    def on(self, tables: ProbeTables) -> ProbeTables:
        """Return the probe's tables with this inclusion; some seconds."""
        return replace(tables, off_axis=stretched_inclusion(self.scene(), tables.off_axis))


def draw_oblong(count: int, rng: np.random.Generator) -> list[Oblong]:
    """Return so many ellipsoids; offsets are even over the trained disk."""
    inclusions, ratios = clear_inclusions(count, rng), rng.uniform(*WIDTH_RATIO, count)
    offsets_mm, across = HIGH[OFFSET] * np.sqrt(rng.uniform(0, 1, count)), rng.random(count) < 0.5
    return [
        Oblong(Inclusion(*map(float, inclusion)), float(ratio), float(offset), bool(is_across))
        for inclusion, ratio, offset, is_across in zip(inclusions, ratios, offsets_mm, across, strict=True)
    ]


def round_deviations(solved: ProbeTables, parameters: Array, answers: RampAnswers) -> float:
    """Return how many standard deviations a press [9] of an ellipsoid, without noise, lies from any round one.

    Its long axis lies along or across the offset: across the bright side it has no second harmonic, as a round one.
    """
    row = profile_rows(solved, parameters[None])[0]
    posterior = PressPosterior(row, answers.surrogate, answers.noise, direction_rad=np.zeros(1))
    return nearest_round(posterior, normalise(parameters[None])[0])[1]


def most_flagged(deviations: Array, false_flags: float) -> Array:
    """Return the largest shares that a test can flag of presses so far from round.

    Of round ones it flags `false_flags`; it treats all directions alike.
    """
    return np.asarray(ncx2.sf(-2 * np.log(false_flags), 2, np.square(deviations)))


def nearest_round(posterior: PressPosterior, sphere: Array) -> tuple[Array, float]:
    """Return coordinates [9] and distance in standard deviations of the round inclusion nearest to a row.

    The search begins at the sphere as wide as the ellipsoid, coordinates [9].
    """

    def jacobian(normalised: Array) -> Array:
        return np.asarray(posterior.residuals_and_jacobian(normalised[None])[1][0])

    start = np.clip(best_fit(posterior, sphere), -0.98, 0.98)
    found = least_squares(posterior.residuals, start, jac=jacobian, bounds=(-1.0, 1.0), xtol=1e-7, ftol=1e-7)
    return np.asarray(found.x), float(np.sqrt(2 * found.cost))


def spoken(oblong: Oblong) -> Sequence[str]:
    """Return size, depth, modulus, ratio, offset and direction as table cells."""
    size_mm, depth_mm, modulus_kpa = oblong.inclusion.as_tuple()
    return (
        f"{size_mm:.1f}", f"{depth_mm:.1f}", f"{modulus_kpa:.0f}",
        f"{oblong.width_ratio:.2f}", f"{oblong.offset_mm:.1f}",
        "across" if oblong.is_across else "along",
    )  # fmt: skip


def oblong_chapter(answer: EstimateOf, answers: RampAnswers, tables: ProbeTables, *, jobs: int = -1) -> Chapter:
    """Return how often presses of each ellipsoid are refused in mode standard; mode quick is shown and not judged."""
    seed = derived_seed(1, "oblong")
    rng = np.random.default_rng(seed)
    inclusions = draw_oblong(ELLIPSOIDS, rng)
    solved = in_parallel(lambda i: inclusions[i].on(tables), len(inclusions), jobs)
    parameters = skins(inclusions, rng)
    press = partial(_is_refused, answer, solved, parameters, seed)
    refused, by_quick = (
        np.array(in_parallel(partial(press, mode), len(parameters), jobs), float) for mode in (MODE, QUICK)
    )
    apart = np.array(in_parallel(partial(_apart, solved, parameters, answers), len(parameters), jobs))
    return Chapter(
        title="Inclusions that are not round",
        claim=CLAIM,
        source="Lehmann & Romano, Testing Statistical Hypotheses (2005), 6.3; "
        "device/measurement/ramp_modes/ellipticity.py",
        benchmarks=(_benchmark(apart, refused),),
        tables=(
            Table("All of them", SUMMARY, (_sum(MODE, refused, apart), _sum(QUICK, by_quick))),
            Table("Each ellipsoid, means", HEADER, tuple(_rows(inclusions, apart, refused))),
        ),
        facts={"false_at_most": FALSE_AT_MOST, "refused_at_least": REFUSED_AT_LEAST},
    )


def skins(inclusions: Sequence[Oblong], rng: np.random.Generator) -> Array:
    """Return parameters [n, 9] of `SKINS` presses of each inclusion, in tissue about that which it is solved in."""
    alike = np.repeat([oblong.inclusion.as_tuple() for oblong in inclusions], SKINS, axis=0)
    parameters = draw_around(alike, rng, ranges=NEAR_NOMINAL)
    parameters[:, -1] = np.repeat([oblong.offset_mm for oblong in inclusions], SKINS)
    return parameters


def _is_refused(
    answer: EstimateOf, solved: Sequence[ProbeTables], parameters: Array, seed: int, mode: Mode, number: int
) -> bool:
    of_press = press_seed(seed, number)
    recording = recorded_press(solved[number // SKINS], parameters[number], mode, of_press, levels=ErrorLevels())
    return answer(recording, mode).size_mm.value is None


def _apart(solved: Sequence[ProbeTables], parameters: Array, answers: RampAnswers, number: int) -> float:
    return round_deviations(solved[number // SKINS], parameters[number], answers)


def _benchmark(apart: Array, refused: Array) -> Benchmark:
    """Return the benchmark of the presses that a test flags nearly always; NaN, and failed, without any."""
    tellable = most_flagged(apart, FALSE_AT_MOST) >= REFUSED_AT_LEAST
    share = float(refused[tellable].mean()) if tellable.any() else float("nan")
    case = f"{MODE}, ellipsoids that a test could tell ({int(tellable.sum())} presses)"
    return at_least(case, SHARE, share, REFUSED_AT_LEAST)


def _sum(mode: Mode, refused: Array, apart: Array | None = None) -> tuple[str, ...]:
    could = "-" if apart is None else f"{most_flagged(apart, FALSE_AT_MOST).mean():.1%}"
    return mode, f"{refused.mean():.1%}", could


def _rows(inclusions: Sequence[Oblong], apart: Array, refused: Array) -> list[tuple[str, ...]]:
    could = most_flagged(apart, FALSE_AT_MOST)
    means = zip(inclusions, *(part.reshape(-1, SKINS).mean(axis=1) for part in (apart, could, refused)), strict=True)
    return [
        (MODE, *spoken(inclusion), f"{deviations:.1f}", f"{most:.0%}", f"{share:.0%}")
        for inclusion, deviations, most, share in means
    ]
