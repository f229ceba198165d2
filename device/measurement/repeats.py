"""How far repeated presses of one lesion agree, of one unknown: mean, spread, and an index of repeatability.

The index is the repeatability coefficient over the mean. That coefficient is 1.96 sqrt(2) times the spread: by so much
or less two presses differ in 19 of 20 cases. It is of one method: modes differ by more than presses of one mode do.
Sources: Bland & Altman, Lancet 327, 307 (1986), "repeatability"; ISO 5725-6, "repeatability limit" (2.8 times the
spread).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import Any

from device.measurement.quantities import UNKNOWNS

APART = 1.96 * math.sqrt(2.0)


@dataclass(frozen=True)
class Repeats:
    """Presses that determine an unknown: how many, their mean and spread in its unit, and the index, a ratio.

    `mean` is None of no press; `spread`, the standard deviation, and `repeatability_index` of fewer than two, the index
    of several modes, too. An index of 0.1: 19 of 20 pairs of presses differ by less than a tenth of the mean.
    """

    presses: int
    mean: float | None
    spread: float | None
    repeatability_index: float | None


def repeats_of(values: Sequence[float], *, is_of_one_mode: bool = True) -> Repeats:
    """Return how far values above 0 agree, of one unknown in its unit."""
    if not values:
        return Repeats(0, None, None, None)
    mean = fmean(values)
    if len(values) == 1:
        return Repeats(1, mean, None, None)
    spread = stdev(values)
    return Repeats(len(values), mean, spread, APART * spread / mean if is_of_one_mode else None)


def repeats_by_unknown(estimates: Sequence[dict[str, Any]]) -> dict[str, Repeats]:
    """Return the same by unknown, of estimates as records have them; a press counts where it determines the unknown."""
    found = {}
    for name in UNKNOWNS:
        told = [one for one in estimates if one[name]["identifiable"] and one[name]["value"] is not None]
        modes = {one["mode"] for one in told}
        found[name] = repeats_of([one[name]["value"] for one in told], is_of_one_mode=len(modes) == 1)
    return found
