"""How far repeated presses of one lesion agree, of one unknown: mean, spread, and an index of repeatability.

The index is the repeatability coefficient over the mean. That coefficient is 1.96 sqrt(2) times the spread: by so much
or less two presses differ in 19 of 20 cases. All of it is of one method, that is one mode and one model, of tissue or
simulated: methods differ by more than presses of one do, and in what an answer rests on.
Sources: Bland & Altman, Lancet 327, 307 (1986), "repeatability"; ISO 5725-6, "repeatability limit" (2.8 times the
spread).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev
from typing import Any, NamedTuple

from device.measurement.quantities import UNKNOWNS
from device.measurement.shown_quantity import has_open_end

APART = 1.96 * math.sqrt(2.0)


class PressMethod(NamedTuple):
    """What presses have to have in common to be compared: mode, model by its sha256, and whether simulated."""

    mode: str
    model: str
    is_simulated: bool


@dataclass(frozen=True)
class Repeats:
    """Presses that determine an unknown: how many, their mean and spread in its unit, and the index, a ratio.

    `mean` is None of no press; `spread`, the standard deviation, and `repeatability_index` of fewer than two. All three
    are None of several methods, and while one of the presses has an open end (`open_presses`): "13 mm or more" has no
    middle, and values that the end of the trained range holds together only seem to agree. An index of 0.1: 19 of 20
    pairs of presses differ by less than a tenth of the mean.
    """

    presses: int
    mean: float | None
    spread: float | None
    repeatability_index: float | None
    open_presses: int = 0


def repeats_of(values: Sequence[float], *, is_of_one_method: bool = True, open_presses: int = 0) -> Repeats:
    """Return how far values above 0 agree, of one unknown in its unit; so many of them have an open end."""
    if not values or open_presses or not is_of_one_method:
        return Repeats(len(values), None, None, None, open_presses)
    mean = fmean(values)
    if len(values) == 1:
        return Repeats(1, mean, None, None)
    spread = stdev(values)
    return Repeats(len(values), mean, spread, APART * spread / mean)


def model_of(estimate: Mapping[str, Any]) -> str:
    """Return the sha256 of the card by which an estimate was made, of before there was one that of the network."""
    return str(estimate.get("model_card_sha256") or estimate["model_sha256"])


def method_of(estimate: Mapping[str, Any]) -> PressMethod:
    """Return by what an estimate, as records have it, was made."""
    return PressMethod(estimate["mode"], model_of(estimate), bool(estimate["simulated"]))


def repeats_by_unknown(estimates: Sequence[Mapping[str, Any]]) -> dict[str, Repeats]:
    """Return the same by unknown, of estimates as records have them; a press counts where it determines the unknown."""
    found = {}
    for name in UNKNOWNS:
        told = [one for one in estimates if one[name]["identifiable"] and one[name]["value"] is not None]
        is_of_one_method = len({method_of(one) for one in told}) == 1
        open_presses = sum(has_open_end(one[name]) for one in told)
        values = [one[name]["value"] for one in told]
        found[name] = repeats_of(values, is_of_one_method=is_of_one_method, open_presses=open_presses)
    return found
