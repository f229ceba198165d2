"""Forces that are known to what the load cell says: nothing at rest, and a weight where the operator puts one on."""

from __future__ import annotations

from device.instrument.self_test.result import Result, judged, not_tested
from device.measurement.quantities import Bound

PART = "Load cell"
WEIGHT_TOLERANCE_RATIO = 0.02
"""A calibration holds at one force; an error of the force of 2 % is one of the light by as much."""


def rest_results(force_n: float, zero_shift_n: float, max_rest_n: float, max_shift_n: float) -> list[Result]:
    """Return the zero of the free probe: from the last tare, and from that of commissioning (N)."""
    free = "Hold the probe free and repeat the test; if it stays, tare."
    moved = "Hold the probe free and start again; if it stays, have the load cell checked and commissioned anew."
    rest, shift = Bound(-max_rest_n, max_rest_n, "N"), Bound(-max_shift_n, max_shift_n, "N")
    return [
        judged(PART, "zero", force_n, rest, free),
        judged(PART, "zero since commissioning", zero_shift_n + force_n, shift, moved),
    ]


def weight_result(force_n: float, weight_n: float, max_rest_n: float) -> Result:
    """Return whether a known weight is measured as what it is, within 2 % or the zero's tolerance."""
    tolerance_n = max(WEIGHT_TOLERANCE_RATIO * weight_n, max_rest_n)
    bound = Bound(weight_n - tolerance_n, weight_n + tolerance_n, "N")
    return judged(PART, "known weight", force_n, bound, "Check cell.sensitivity_counts_per_n, or calibrate the cell.")


def untested_weight(remedy: str = "Repeat it with a known weight.") -> Result:
    """Return that no weight was measured, and what it takes."""
    return not_tested(PART, "known weight", remedy)
