"""The posterior of a press to 90 % intervals that hold whatever the modulus is.

The modulus is what presses tell least of, and size and depth hang on it. A posterior's own interval weighs its values
by how many inclusions have each of them, so it covers nine in ten of all inclusions and misses many of the softest and
the hardest. So size and depth are profiled: a value is in the interval when it is likely under some modulus, by the
likelihood ratio whose distribution needs no prior. Nothing in it is calibrated on simulated presses. The modulus has
its mean and spread, and is open where an end of its range is as likely by that ratio: a press that only rules out what
is softer says "or more".
Sources: Wilks, Ann. Math. Stat. 9 (1938); Cox & Hinkley, Theoretical Statistics (1974), 9.3, profile likelihood;
docs/modes.md counts how often intervals hold, by octiles of every unknown.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.confidence_belt import IDENTIFIABLE_RATIO
from device.measurement.parameters import COUNT, EVEN_STD
from device.measurement.ramp_modes.joint_region import pooled
from device.measurement.ramp_modes.posterior import PressFit
from device.measurement.ramp_modes.surrogate import MODULUS

CHI_SQUARE_90 = 2.7055
"""Nine in ten of the chi-square distribution's values of one degree of freedom lie below."""
SMALLEST_SHARE = 1e-12


class PressIntervals(NamedTuple):
    """Ends [3] of the unknowns' intervals in coordinates, and whether the press narrows each one's range down."""

    low: Array
    high: Array
    is_identifiable: NDArray[np.bool_]


def intervals_of(fit: PressFit) -> PressIntervals:
    """Return the intervals of a posterior; what it does not narrow down has the whole range."""
    ends = np.array([_profiled(fit, unknown) for unknown in range(COUNT)]).T
    low, high = np.clip(ends, -1.0, 1.0)
    known = (fit.spread[:COUNT] < IDENTIFIABLE_RATIO * EVEN_STD) & (high - low < 2)
    return PressIntervals(np.where(known, low, -1.0), np.where(known, high, 1.0), known)


def _profiled(fit: PressFit, unknown: int) -> tuple[float, float]:
    """Return the ends of the values of an unknown that are likely under the modulus of some cell.

    Within a cell the unknown is Gaussian; the modulus itself has no other to be profiled over.
    """
    mean, spread = fit.mean[unknown], fit.spread[unknown]
    cells = fit.by_modulus
    if unknown == MODULUS:
        half = float(np.sqrt(CHI_SQUARE_90) * spread)
        opened = -2 * np.log(np.maximum(cells.share / cells.share.max(), SMALLEST_SHARE)) <= CHI_SQUARE_90
        return -1.0 if opened[0] else float(mean) - half, 1.0 if opened[-1] else float(mean) + half
    seen = cells.share > SMALLEST_SHARE
    spread = np.sqrt(pooled(cells.spread[seen, unknown] ** 2, cells.share[seen], cells.worth[seen]))
    mean = cells.mean[seen, unknown]
    deviance = -2 * np.log(cells.share[seen] / spread)
    half = spread * np.sqrt(np.maximum(CHI_SQUARE_90 - (deviance - deviance.min()), 0.0))
    likely = half > 0
    return float(np.min((mean - half)[likely])), float(np.max((mean + half)[likely]))
