"""Ellipsoids longer than wide, in the middle and beside it: what any test can tell of them from a lump that is round.

What being longer adds to a sphere is solved by finite elements for each, its long axis along or across its offset, and
carried on to the probe's own sphere (`stretched_lump`). How far a press of it lies from
its nearest round twin inside the ranges - in the profile and in the second harmonics at once, whatever tissue and skin
the twin has - bounds any test that, as the probe, does not know which way a lump is longer.
Source: Lehmann & Romano, Testing Statistical Hypotheses (2005), 6.3: of tests that treat all directions alike the best
one rejects by the length, whose square is a noncentral chi-square of two degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares
from scipy.stats import ncx2

from device.measurement.fit_press import PressPosterior, best_fit
from device.measurement.mode import Mode
from device.measurement.press_parameters import HIGH, to_unit
from device.measurement.press_surrogate import OFFSET
from device.measurement.profile_model import ProfileModel
from device.measurement.quantities import Inclusion
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.press_samples import Array, exact_presses
from host_tools.scene import Placement, Scene
from host_tools.stretched_lump import stretched_lump
from host_tools.study.outside_presses import clear_lumps

WIDTH_RATIO = (1.6, 2.4)


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
        """Return the probe's tables with this lump; some seconds."""
        return replace(tables, off_axis=stretched_lump(self.scene(), tables.off_axis))


def draw_oblong(count: int, rng: np.random.Generator) -> list[Oblong]:
    """Return so many ellipsoids; offsets are even over the trained disk."""
    lumps, ratios = clear_lumps(count, rng), rng.uniform(*WIDTH_RATIO, count)
    offsets_mm, across = HIGH[OFFSET] * np.sqrt(rng.uniform(0, 1, count)), rng.random(count) < 0.5
    return [
        Oblong(Inclusion(*map(float, lump)), float(ratio), float(offset), bool(is_across))
        for lump, ratio, offset, is_across in zip(lumps, ratios, offsets_mm, across, strict=True)
    ]


def round_deviations(solved: ProbeTables, parameters: Array, model: ProfileModel, mode: Mode) -> float:
    """Return how many standard deviations a press [9] of an ellipsoid, without noise, lies from any round one."""
    rows, second = exact_presses(solved, parameters[None])
    posterior = PressPosterior(rows[0], model.answers.surrogate, model.answers.noise[mode])
    harmonics, sphere = np.stack([second[0], np.zeros_like(second[0])]), to_unit(parameters[None])[0]
    return twin_of(posterior, harmonics, sphere, model, mode)[1]


def most_flagged(deviations: Array, false_flags: float) -> Array:
    """Return the largest shares that a test can flag of presses so far from round, when it flags `false_flags` of round
    ones and treats all directions alike."""
    return np.asarray(ncx2.sf(-2 * np.log(false_flags), 2, np.square(deviations)))


def twin_of(
    posterior: PressPosterior, second: Array, sphere: Array, model: ProfileModel, mode: Mode
) -> tuple[Array, float]:
    """Return coordinates [9] and distance in standard deviations of the round lump nearest to row and harmonics.

    The search begins at the sphere as wide as the ellipsoid, coordinates [9]: first for the row, then for both.
    """
    start = best_fit(posterior, sphere)
    factor = np.linalg.cholesky(model.round_spot.covariance(start, mode))

    def residuals(unit: Array) -> Array:
        of_second = solve_triangular(factor, model.round_spot.left(second, unit).T, lower=True, check_finite=False)
        return np.concatenate([posterior.residuals(unit), of_second.ravel()])

    found = least_squares(residuals, np.clip(start, -0.98, 0.98), bounds=(-1.0, 1.0), xtol=1e-7, ftol=1e-7)
    return np.asarray(found.x), float(np.sqrt(2 * found.cost))


def spoken(lump: Oblong) -> Sequence[str]:
    """Return size, depth, modulus, ratio, offset and direction as table cells."""
    size_mm, depth_mm, modulus_kpa = lump.inclusion.as_tuple()
    return (
        f"{size_mm:.1f}", f"{depth_mm:.1f}", f"{modulus_kpa:.0f}", f"{lump.width_ratio:.2f}", f"{lump.offset_mm:.1f}",
        "across" if lump.is_across else "along",
    )  # fmt: skip
