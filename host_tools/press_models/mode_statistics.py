"""Answers of a mode to what its model card and `host_tools evaluate` say of it: errors, skill and coverage, by octiles.

An error in percent is (estimate - truth) / truth. Skill is 1 - (root mean square error / standard deviation of the even
prior): 0 is as good as the middle of the range, 1 is perfect. Coverage counts only intervals of presses that determine
the unknown, since the others hold the whole range and so always the truth.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from device.measurement.arrays import Array
from device.measurement.confidence_belt import Belt
from device.measurement.parameters import EVEN_STD, denormalise_unknowns
from device.measurement.quantities import UNKNOWNS
from host_tools.press_models.mode_outcome import EvaluatedPresses

OCTILES = 8
DIGITS = 4


def statistics(evaluated: EvaluatedPresses, belts: tuple[Belt, ...]) -> dict[str, Any]:
    """Return the statistics of presses by unknown."""
    covered, known = evaluated.covered(belts)
    truth, mean = denormalise_unknowns(evaluated.truth), denormalise_unknowns(evaluated.mean)
    percent = 100 * (mean - truth) / truth
    error = evaluated.mean - evaluated.truth
    return {"presses": len(truth)} | {
        name: _of_unknown(truth[:, i], percent[:, i], error[:, i], covered[:, i], known[:, i])
        for i, name in enumerate(UNKNOWNS)
    }


def octile_ends(truth: Array) -> Array:
    """Return the ends [9] of the octiles of truths [n]."""
    return np.asarray(np.quantile(truth, np.linspace(0, 1, OCTILES + 1)))


def octile_of(truth: Array) -> Array:
    """Return the octile [n], 0 to 7, in which each truth lies."""
    return np.clip(np.searchsorted(octile_ends(truth), truth, side="right") - 1, 0, OCTILES - 1)


def _of_unknown(truth: Array, percent: Array, error: Array, covered: Array, known: Array) -> dict[str, Any]:
    octile = octile_of(truth)
    of_octile = [octile == number for number in range(OCTILES)]
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
    }


def _coverage(covered: Array, known: Array) -> float | None:
    """Return the covered share of the determined ones; None where none is."""
    return _mean(covered[known])


def _mean(values: Array) -> float | None:
    return _rounded(values.mean()) if len(values) else None


def _rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))


def _rounded(value: float) -> float:
    return float(np.format_float_positional(value, precision=DIGITS, fractional=False))
