"""Counts of the load cell to a verdict: what it bears and where its zero has gone, both from its zero at commissioning.

The tare of each start takes weight and warm-up away, and would take a clamped or bent cell away with them: a probe that
was started under 3 N would then bear 3 N more than it may. So the limit never moves with that tare.
Source: two tares, as Klipper's load cell probe has them (docs/Load_Cell.md, reference_tare_counts).
"""

from __future__ import annotations

from dataclasses import dataclass

from device.errors import OverloadedCellError, ZeroShiftError
from device.hardware.interfaces import CellCounts, ForceScale


@dataclass(frozen=True)
class LoadLimit:
    """The cell's scale as commissioned, the load (N) it bears either way, and how far (N) its zero may go."""

    commissioned: ForceScale
    max_load_n: float
    max_drift_n: float

    def require_tare(self, tare_counts: CellCounts) -> None:
        """Raise `ZeroShiftError` when a tare is too far from that of commissioning."""
        drift_n = self.commissioned.newtons(tare_counts)
        if abs(drift_n) > self.max_drift_n:
            raise ZeroShiftError(
                f"The load cell's zero is {tare_counts:.0f} counts, {drift_n:+.2f} N from the "
                f"{self.commissioned.tare_counts:.0f} of commissioning, above the {self.max_drift_n:g} N allowed.",
                "Lift the probe and let nothing touch it; if it stays, have its load cell checked and commissioned.",
            )

    def require_bearable(self, counts: CellCounts) -> None:
        """Raise `OverloadedCellError` when a reading is more load than the cell bears, pushed or pulled."""
        load_n = self.commissioned.newtons(counts)
        if abs(load_n) > self.max_load_n:
            raise OverloadedCellError(
                f"The load cell carries {load_n:+.2f} N from its zero at commissioning, above the "
                f"{self.max_load_n:g} N it bears.",
                "Take the load off the probe at once; if it stays, check that nothing clamps the cell.",
            )
