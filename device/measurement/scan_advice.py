"""What the presses of a scan tell so far, and where on the lesion the next one would tell most.

Presses at different places add up where repeated ones do not; so a scan asks after each of them whether another is
worth it, and where.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from device.measurement.estimate import Estimate, Quantity
from device.measurement.quantities import UNKNOWNS


@dataclass(frozen=True)
class ScanAdvice:
    """What the ramps so far tell, and where the next one would tell most.

    `estimate`: of all ramps so far. `half_width`: half of each 90 % interval in the unknown's own unit, by unknown;
    those without numbers are left out. `next_offset_mm`: how far beside the lesion's middle to press next; None: no
    further ramp would tell much. `expected_half_width`: what is expected after that ramp.
    """

    estimate: Estimate
    half_width: Mapping[str, float]
    next_offset_mm: float | None
    expected_half_width: Mapping[str, float]


def half_widths(estimate: Estimate) -> dict[str, float]:
    """Return half of each 90 % interval in the unknown's own unit; unknowns without numbers are left out."""
    of_unknowns: dict[str, Quantity] = {name: getattr(estimate, name) for name in UNKNOWNS}
    return {
        name: (one.high - one.low) / 2
        for name, one in of_unknowns.items()
        if one.low is not None and one.high is not None
    }
