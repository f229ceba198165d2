"""Sensitivities to the few sentences that say which feature knows what; names and figures are picked from the run."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from device.measurement.paper_mode.feature_definitions import PAPER_FEATURES, PRESS_FEATURES, RAMP_FEATURES
from device.measurement.quantities import UNKNOWNS
from host_tools.replication.feature_sensitivity import (
    CONTACT,
    DISTURBANCES,
    DRIFT,
    OFFSET,
    ZERO,
    ZERO_AFTER,
    Sensitivity,
)

SHOWN_AT = "0.40 N"
TEN_PERCENT = "10 %"
RINGS = ("contrast_0.40_n_0.0_mm", "contrast_0.40_n_4.5_mm", "contrast_0.40_n_9.0_mm")
GROWTH = ("growth_0.12_n_0.0_mm", "growth_0.12_n_9.0_mm")
SHOWN = (
    *(f"{name}_0.40_n" for name in PAPER_FEATURES),
    *RINGS,
    *GROWTH,
    "offset_3.6_mm",
    *(f"{name}_0.40_n" for name in RAMP_FEATURES),
    *PRESS_FEATURES,
)
"""The features of the page's tables; those of the ramp at the force nearest to a held press's."""
WORDS = dict(zip(UNKNOWNS, ("size", "depth", "Young's modulus"), strict=True))
PEAK, TOTAL, SIGMA = "peak_contrast_0.40_n", "total_contrast_mm2_0.40_n", "gaussian_sigma_mm_0.40_n"
SHIFT, WIDTH = "mean_centroid_offset_mm", "full_width_half_maximum_mm_0.40_n"

Move = Callable[[Sensitivity, str], float]
"""How far something moves a feature of a scene, in units of its scatter."""


def reading(scenes: Sequence[Sensitivity]) -> tuple[str, ...]:
    """Return the sentences, one a line."""
    return tuple(f"- {sentence}" for sentence in (_best(scenes), _alike(scenes), _skin(scenes), _others(scenes)))


def extremes(scenes: Sequence[Sensitivity]) -> list[tuple[str, ...]]:
    """Return for each disturbance the features that it moves most in every scene, and least in any."""
    rows = []
    for disturbance in DISTURBANCES:

        def move(one: Sensitivity, name: str, disturbance: str = disturbance) -> float:
            return one.disturbed(disturbance, name)

        most, least = _most(scenes, move), _least(scenes, move)
        rows.append((disturbance, *(f"`{name}` ({moved:.1f})" for name, moved in (most, least))))
    return rows


def _most(scenes: Sequence[Sensitivity], move: Move) -> tuple[str, float]:
    """Return the feature that is moved furthest where it is moved least, and how far."""
    moved = {name: min(move(one, name) for one in scenes) for name in SHOWN}
    name = max(moved, key=moved.__getitem__)
    return name, moved[name]


def _least(scenes: Sequence[Sensitivity], move: Move) -> tuple[str, float]:
    """Return the feature of the inclusion that is moved least where it is moved furthest, and how far."""
    moved = {name: max(move(one, name) for one in scenes) for name in SHOWN if name not in GROWTH}
    name = min(moved, key=moved.__getitem__)
    return name, moved[name]


def _best(scenes: Sequence[Sensitivity]) -> str:
    picks = []
    for unknown, word in WORDS.items():
        name, moved = _most(scenes, lambda one, name, unknown=unknown: one.moved(unknown, name))  # type: ignore[misc]
        picks.append(f"{word} `{name}` ({moved:.0f})")
    return f"What {TEN_PERCENT} of an unknown moves most, at least so many times its scatter: {', '.join(picks)}."


def _alike(scenes: Sequence[Sensitivity]) -> str:
    """Say how little of size or depth does to the peak what some of Young's modulus does, and what the width does."""
    size, depth, E = ([one.slopes[unknown][PEAK] for one in scenes] for unknown in UNKNOWNS)
    larger = _range([10 * e / d for d, e in zip(size, E, strict=True)])
    deeper = _range([-10 * e / h for h, e in zip(depth, E, strict=True)])
    width = max(one.moved(UNKNOWNS[2], WIDTH) for one in scenes)
    return (
        f"Brightness alone does not tell Young's modulus from the other two: what {TEN_PERCENT} of it does to "
        f"`{PEAK}`, {larger} % more size or {deeper} % less depth do too; and it moves `{WIDTH}` by at most "
        f"{width:.1f} times its scatter."
    )


def _skin(scenes: Sequence[Sensitivity]) -> str:
    worth = [math.expm1(one.changes[CONTACT][PEAK] / one.slopes[UNKNOWNS[2]][PEAK]) for one in scenes]
    moved = min(one.disturbed(CONTACT, GROWTH[0]) for one in scenes)
    inclusion = max(one.moved(unknown, GROWTH[0]) for one in scenes for unknown in UNKNOWNS)
    return (
        f"The skin counts too: {CONTACT} is worth {_range([100 * ratio for ratio in worth])} % more Young's modulus at "
        f"`{PEAK}`. The reference press shows it: `{GROWTH[0]}` moves by {moved:.0f} times its scatter or more, "
        f"and by at most {inclusion:.1f} with {TEN_PERCENT} of any unknown."
    )


def _others(scenes: Sequence[Sensitivity]) -> str:
    total = [100 * abs(one.changes[DRIFT][TOTAL] / one.value[TOTAL]) for one in scenes]
    sigma = max(one.disturbed(DRIFT, SIGMA) for one in scenes)
    shift_mm = [one.value[SHIFT] + one.changes[OFFSET][SHIFT] for one in scenes]
    zero, after = (max(one.disturbed(name, shown) for one in scenes for shown in SHOWN) for name in (ZERO, ZERO_AFTER))
    return (
        f"{DRIFT}, `{TOTAL}` is {_range(total)} % off and `{SIGMA}` at most {sigma:.1f} times its scatter: the "
        f"Gaussian's constant takes the drift. {OFFSET}, `{SHIFT}` reads {_range(shift_mm)} mm. A zero error of "
        f"the cell moves no feature by more than {zero:.1f} times its scatter, and by {after:.1f} if only the press "
        "has it."
    )


def _range(values: Sequence[float]) -> str:
    low, high = (f"{value:.2g}" for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
