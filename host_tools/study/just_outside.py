"""Lumps just outside the trained ranges: how like one inside they look, and what the modes make of them.

An image that some lump inside explains as well as the noise lets one see cannot be flagged by any test. How well that
is possible is the distance of the press without noise from its nearest twin inside, whatever tissue and skin the twin
has. Source: Neyman & Pearson, Phil. Trans. R. Soc. A 231 (1933): the best test between two means d standard deviations
apart has the power Phi(d - z).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import norm

from device.measurement.estimate import Quantity
from device.measurement.fit_press import PressPosterior
from device.measurement.press_parameters import HIGH, LOW, NOMINAL, PARAMETERS, from_unit
from device.measurement.quantities import Inclusion
from device.simulation.surface_table import PressRamps, Ramp
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.mode_outcome import USUAL_RATIO
from host_tools.inverse.press_samples import Array
from host_tools.scene import Scene
from host_tools.surface_table import press_ramps

FALSE_FLAGS = 1 - USUAL_RATIO
"""Share of presses inside that this doubt may flag: misfit and elongation flag as many each, all three at most 5 %."""
STARTS = 6
"""Fits from as many places, of which the best one counts."""

LUMPS = (
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


@dataclass(frozen=True)
class Twin:
    """The lump inside the ranges that looks most like one outside, and their distance in standard deviations."""

    inclusion: Inclusion
    deviations: float

    def most_flagged(self, false_flags: float = FALSE_FLAGS) -> float:
        """Return the largest share that any test can flag of the one, when it flags `false_flags` of the other."""
        return float(norm.cdf(self.deviations - norm.isf(false_flags)))


def at_nominal(inclusion: Inclusion) -> Array:
    """Return the parameters [9] of a lump on the axis, below the nominal tissue and skin."""
    at = {**NOMINAL, **vars(inclusion)}
    return np.array([at[name] for name in PARAMETERS])


def lump_ramps(tables: ProbeTables, inclusion: Inclusion) -> PressRamps:
    """Return the ramps of a lump in the nominal slab: from the tables, or solved where they end.

    The ramp beside a solved lump is the tables' own, so that nothing but the lump tells it from theirs.
    """
    size_mm, depth_mm, modulus_kpa = inclusion.as_tuple()
    inside_mm = np.clip([size_mm, depth_mm], LOW[:2], HIGH[:2])
    own = tables.centred.ramps(Inclusion(float(inside_mm[0]), float(inside_mm[1]), modulus_kpa))
    if np.array_equal(inside_mm, [size_mm, depth_mm]):
        return own
    solved = press_ramps(Scene(inclusion))
    fields = [[np.interp(solved.r_mm, own.r_mm, of_load) for of_load in field] for field in own.bare.fields_per_n]
    return PressRamps(solved.r_mm, Ramp(own.bare.force_n, np.array(fields)), solved.lump)


def nearest_twin(posterior: PressPosterior, seed: int) -> Twin:
    """Return what inside the ranges looks most like a press without noise."""
    starts = np.random.default_rng(seed).uniform(-0.9, 0.9, (STARTS, len(PARAMETERS)))
    fits = [
        least_squares(posterior.residuals, start, jac=posterior.jacobian, bounds=(-1.0, 1.0), xtol=1e-7, ftol=1e-7)
        for start in starts
    ]
    best = min(fits, key=lambda fit: float(fit.cost))
    return Twin(Inclusion(*map(float, from_unit(best.x)[:3])), float(np.sqrt(2 * best.cost)))


def holds(quantity: Quantity, truth: float) -> bool:
    """Return whether an interval holds the truth; an open end holds all that lies beyond it."""
    if quantity.low is None or quantity.high is None:
        return False
    return (quantity.low_is_open or quantity.low <= truth) and (quantity.high_is_open or truth <= quantity.high)


def spoken(inclusion: Inclusion) -> Sequence[str]:
    """Return size, depth and modulus as table cells."""
    return f"{inclusion.size_mm:.3g}", f"{inclusion.depth_mm:.3g}", f"{inclusion.youngs_modulus_kpa:.3g}"
