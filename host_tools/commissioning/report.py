"""What commissioning found, in lines: the probe beside its tolerances, and phantoms that were answered as unknown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta

from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.commissioned.row_derivatives import NAMES
from host_tools.commissioning.joint_fit import (
    DISCREPANCY_RATIOS,
    FLAT_FIELD_RATIOS,
    MODEL_RATIOS,
    UNLIKE_CASTINGS,
    ProbeFit,
)
from host_tools.commissioning.left_out import LeftOut, covered
from host_tools.commissioning.probe_prior import LABELS

WIDTH = max(map(len, LABELS.values()))
SILICONE = "Fitted layers carry what the model lacks, and are never a measurement of the silicone."

DESIGN_EFFECT = 1.22
"""Intervals of size and depth of one press hold together more often than by chance: of 20 000 presses of mode standard
0.9254 and 0.9103 hold, and both in 0.8588, which is a correlation of 0.22. Two such count as 2 / 1.22. That ramps of
one phantom hang together, too, is not counted: nobody measured by how much."""


def probe_lines(fit: ProbeFit, directions: NDArray[np.intp]) -> Iterator[str]:
    """Yield what is known of the probe, beside what was expected, and what its layers are not."""
    yield f"{'of the probe':{WIDTH}} {'found':>8} {'1 sd':>8} {'expected':>9} {'tolerance':>10}"
    std, prior = np.sqrt(np.diag(fit.covariance)), fit.prior
    for number, mean, own in zip(directions, fit.mean, std, strict=True):
        name, expected, tolerance = LABELS[NAMES[number]], prior.mean[number], prior.std[number]
        yield f"{name:{WIDTH}} {mean:8.4f} {own:8.4f} {expected:9.4f} {tolerance:10.3g}"
    yield f"{'lacking of an inclusion':{WIDTH}} {fit.believed.discrepancy_ratio:8.2%}"
    yield f"{'model error of a press':{WIDTH}} {fit.levels.model_ratio:8.2%}"
    yield f"{'skin and flat field':{WIDTH}} {fit.levels.flat_field_ratio:8.2%}"
    yield SILICONE


def levels_at_their_end(fit: ProbeFit) -> Iterator[str]:
    """Yield a sentence on each level of errors that is the largest of those weighed: it may be larger still."""
    for name, level, largest in (
        ("what the forward model lacks", fit.believed.discrepancy_ratio / UNLIKE_CASTINGS, DISCREPANCY_RATIOS[-1]),
        ("the model error of a press", fit.believed.model_ratio, MODEL_RATIOS[-1]),
        ("skin and flat field", fit.believed.flat_field_ratio, FLAT_FIELD_RATIOS[-1]),
    ):
        if level >= largest:
            yield (
                f"Of {name} the largest level that is weighed is the likeliest, {level:.1%}: it may be larger still, "
                "and intervals too narrow. Look for what differs from the design, and commission again."
            )


def coverage_told(phantoms: Sequence[LeftOut]) -> Iterator[str]:
    """Yield what so few truths tell of how often intervals hold: the least share that chance alone would not refuse.

    One-sided, 95 %, of as many as would be independent. Sources: Clopper & Pearson, Biometrika 26 (1934); Kish, Survey
    Sampling (1965), section 5.4, on the design effect.
    """
    known = covered(phantoms)
    if held := int(known.sum()):
        independent, missed = held / DESIGN_EFFECT, (len(known) - held) / DESIGN_EFFECT
        least = float(beta.ppf(0.05, independent, missed + 1))
        yield (
            f"{held} of {len(known)} sizes and depths of phantoms left out are in their intervals. That says that "
            f"these hold in {least:.0%} at least of such presses: record each phantom again, 3 mm aside, to know more."
        )


def phantom_lines(phantoms: Sequence[LeftOut]) -> Iterator[str]:
    """Yield how each phantom left out was answered."""
    yield f"{'phantom left out':18} {'misfit':>6}  " + "  ".join(f"{name:>32}" for name in UNKNOWNS)
    for one in phantoms:
        yield f"{one.name:18} {one.misfit_ratio:6.2f}  " + "  ".join(
            f"{_told(one, place):>32}" for place in range(len(UNKNOWNS))
        )


def _told(one: LeftOut, place: int) -> str:
    """Return stated truth and interval of an unknown, and whether they fit each other."""
    low, high, truth = one.low[place], one.high[place], one.truth[place]
    stated = f"{truth:.3g} +- {one.tolerance[place]:.2g}"
    if not one.is_determined[place]:
        return f"{stated}: not determined"
    held = "fits" if one.is_covered[place] else "NOT in"
    return f"{stated} {held} {low:.3g}-{high:.3g}"
