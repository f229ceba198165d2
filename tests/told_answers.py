"""Answers that are told: presses of sizes and depths with intervals about them, as if a mode had found them."""

from dataclasses import replace

import numpy as np

from device.measurement.parameters import normalise_unknowns
from host_tools.press_models.mode_outcome import EvaluatedPresses
from host_tools.scores.scored_presses import ScoredPresses, joined


def scored_presses(found_mm, truth_mm, half_mm=1.0, answered=True, kpa=60.0, faint=False):
    """Presses of sizes and depths as told, intervals so far either way, all answered or none, or all too faint."""
    mean, truth, low, high = (
        normalise_unknowns(np.column_stack([np.asarray(one, float), np.full(len(one), kpa)]))
        for one in (found_mm, truth_mm, np.subtract(found_mm, half_mm), np.add(found_mm, half_mm))
    )
    count = len(mean)
    known = np.ones((count, 3), bool)
    inside = np.abs(np.subtract(found_mm, truth_mm)).max(axis=1) <= half_mm
    return ScoredPresses(
        EvaluatedPresses(truth, mean, low, high, known, np.column_stack([inside, inside])),
        np.ones(count),
        np.full(count, not faint),
        np.full(count, answered and not faint),
        np.arange(count),
    )


TRUTH_MM = (8.0, 6.0)


def told_presses(good, wrong=0, refused=0, faint=0):
    """So many presses covered, too sure of a wrong size, refused, and too faint for who answers."""
    parts = [
        *([scored_presses([TRUTH_MM] * good, [TRUTH_MM] * good)] if good else []),
        *([scored_presses([(11.0, 6.0)] * wrong, [TRUTH_MM] * wrong)] if wrong else []),
        *([scored_presses([TRUTH_MM] * refused, [TRUTH_MM] * refused, answered=False)] if refused else []),
        *([scored_presses([TRUTH_MM] * faint, [TRUTH_MM] * faint, faint=True)] if faint else []),
    ]
    whole = joined(parts)
    return replace(whole, number=np.arange(len(whole.number)))
