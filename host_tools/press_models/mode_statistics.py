"""Answers of a mode to what its model card and `host_tools evaluate` say of it: errors, skill and coverage, by octiles.

An error in percent is (estimate - truth) / truth. Skill is 1 - (root mean square error / standard deviation of the even
prior): 0 is as good as the middle of the range, 1 is perfect. Coverage counts only intervals of presses that determine
the unknown, since the others hold the whole range and so always the truth: by the unknown's own octiles, by those of
every unknown, and by cells of size and depth. Together the unknowns are covered by their joint region, of every press,
and by the rectangle or box of their intervals, where all are determined.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.confidence_belt import COVERAGE
from device.measurement.parameters import EVEN_STD, denormalise_unknowns
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.posterior import TOGETHER
from host_tools.press_models.mode_outcome import EvaluatedPresses

OCTILES = 8
DIGITS = 4
PARTS = 4
"""Equal parts of the range of size and of depth, which make the cells."""
JOINT = dict(zip(("size_and_depth", "all"), TOGETHER, strict=True))
WIDTH_QUANTILES = np.linspace(0.05, 0.95, 19)
EASIEST = 0.05
"""Share of the determined presses whose interval is narrower than what is called reachable."""


def statistics(evaluated: EvaluatedPresses) -> dict[str, Any]:
    """Return the statistics of presses by unknown, and how often intervals hold together, under `joint`.

    Under `joint_region`: how often the joint regions hold; not there for a mode without any.
    """
    truth, mean = denormalise_unknowns(evaluated.truth), denormalise_unknowns(evaluated.mean)
    percent = 100 * (mean - truth) / truth
    return {"presses": len(truth)} | {
        name: _of_unknown(evaluated, i, truth, percent[:, i]) for i, name in enumerate(UNKNOWNS)
    } | {"joint": {name: _joint(evaluated, count) for name, count in JOINT.items()}} | _regions(evaluated)  # fmt: skip


def _regions(evaluated: EvaluatedPresses) -> dict[str, Any]:
    if evaluated.in_region is None:
        return {}
    return {"joint_region": dict(zip(JOINT, map(_mean, evaluated.in_region.T), strict=True))}


def _joint(evaluated: EvaluatedPresses, count: int) -> float | None:
    """Return how often the intervals of the first unknowns hold together, where all of these are determined."""
    return _coverage(np.all(evaluated.is_covered[:, :count], axis=1), np.all(evaluated.is_known[:, :count], axis=1))


def interval_score(evaluated: EvaluatedPresses) -> Array:
    """Return the mean interval score [3] in coordinates: the width, and for a miss its length times 2 / (1 - level).

    The least mean score is that of the true quantiles. Source: Gneiting & Raftery, JASA 102 (2007), section 6.2.
    """
    below = np.maximum(evaluated.low - evaluated.truth, 0)
    above = np.maximum(evaluated.truth - evaluated.high, 0)
    return np.asarray((evaluated.high - evaluated.low + 2 / (1 - COVERAGE) * (below + above)).mean(axis=0))


def reachable_half_width(evaluated: EvaluatedPresses) -> dict[str, float]:
    """Return half of the narrowest interval that can be had, in each unknown's own unit.

    One press in twenty of those that determine the unknown has a narrower one: presses on the easiest inclusions.
    """
    half = (denormalise_unknowns(evaluated.high) - denormalise_unknowns(evaluated.low)) / 2
    columns = zip(UNKNOWNS, half.T, evaluated.is_known.T, strict=True)
    return {name: _rounded(np.quantile(column[known], EASIEST)) for name, column, known in columns if known.any()}


def half_width_by_ramps(evaluated: EvaluatedPresses, ramps: NDArray[np.intp]) -> dict[str, dict[str, list[float]]]:
    """Return quantiles of half of the intervals, at `WIDTH_QUANTILES`, by the ramps [n] of a scan and by unknown.

    In each unknown's own unit. A scan that does not determine the unknown counts with the whole range.
    """
    half = (denormalise_unknowns(evaluated.high) - denormalise_unknowns(evaluated.low)) / 2
    return {
        f"{count}": {
            name: [_rounded(one) for one in np.quantile(column, WIDTH_QUANTILES)]
            for name, column in zip(UNKNOWNS, half[ramps == count].T, strict=True)
        }
        for count in np.unique(ramps)
    }


def octile_ends(truth: Array) -> Array:
    """Return the ends [9] of the octiles of truths [n]."""
    return np.asarray(np.quantile(truth, np.linspace(0, 1, OCTILES + 1)))


def octile_of(truth: Array) -> NDArray[np.intp]:
    """Return the octile [n], 0 to 7, in which each truth lies."""
    return np.clip(np.searchsorted(octile_ends(truth), truth, side="right") - 1, 0, OCTILES - 1)


def _of_unknown(evaluated: EvaluatedPresses, unknown: int, truths: Array, percent: Array) -> dict[str, Any]:
    truth, error = truths[:, unknown], (evaluated.mean - evaluated.truth)[:, unknown]
    covered, known = evaluated.is_covered[:, unknown], evaluated.is_known[:, unknown]
    of_octiles = {name: _octiles(truths[:, i]) for i, name in enumerate(UNKNOWNS)}
    of_octile = of_octiles[UNKNOWNS[unknown]]
    return {
        "mean_percent": _rounded(np.abs(percent).mean()),
        "sd_percent": _rounded(np.abs(percent).std()),
        "min_percent": _rounded(np.abs(percent).min()),
        "max_percent": _rounded(np.abs(percent).max()),
        "skill": _rounded(1 - _rms(error) / EVEN_STD),
        "determined": _rounded(known.mean()),
        "coverage": _coverage(covered, known),
        "octile_ends": [_rounded(end) for end in octile_ends(truth)],
        "mean_percent_per_octile": [_mean(np.abs(percent[one])) for one in of_octile],
        "rms_coordinate_per_octile": [_rounded(_rms(error[one])) if one.any() else None for one in of_octile],
        "determined_per_octile": [_mean(known[one]) for one in of_octile],
        "coverage_per_octile": [_coverage(covered[one], known[one]) for one in of_octile],
        "coverage_by_octiles": {
            name: [_coverage(covered[one], known[one]) for one in octiles] for name, octiles in of_octiles.items()
        },
        "determined_by_octiles": {name: [_mean(known[one]) for one in octiles] for name, octiles in of_octiles.items()},
        "cells": _by_cells(evaluated.truth, covered, known),
        "interval_score": _rounded(interval_score(evaluated)[unknown]),
    }


def _by_cells(truth: Array, covered: NDArray[np.bool_], known: NDArray[np.bool_]) -> dict[str, list[int]]:
    """Return presses, how many of them are determined and how many of these covered, in cells of size and depth.

    Cells of the smallest sizes come first, the shallowest first among them.
    """
    size, depth = np.clip((PARTS * (truth[:, :2].T + 1) / 2).astype(int), 0, PARTS - 1)
    cell, counted = (
        PARTS * size + depth,
        {"presses": np.ones_like(known), "determined": known, "covered": known & covered},
    )
    return {name: np.bincount(cell[of], minlength=PARTS**2).tolist() for name, of in counted.items()}


def _octiles(truth: Array) -> list[NDArray[np.bool_]]:
    octile = octile_of(truth)
    return [octile == number for number in range(OCTILES)]


def _coverage(covered: NDArray[np.bool_], known: NDArray[np.bool_]) -> float | None:
    """Return the covered share of the determined ones; None where none is."""
    return _mean(covered[known])


def _mean(values: Array | NDArray[np.bool_]) -> float | None:
    return _rounded(values.mean()) if len(values) else None


def _rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _rounded(value: float) -> float:
    return float(np.format_float_positional(value, precision=DIGITS, fractional=False))
