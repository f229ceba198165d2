"""A load cell whose line hangs: the call that reads it does not return while the scenario says so.

The kernel's own drivers can do this, for instance while a USB port is being reset; no time limit of the reader helps.
"""

from __future__ import annotations

from typing import Any

from device.simulation.faults import FaultTimeline


class FreezingCell:
    """A `LoadCell` that reads another one, unless it is frozen."""

    def __init__(self, cell: Any, faults: FaultTimeline) -> None:
        self._cell, self._faults = cell, faults

    def read(self, *, timeout_s: float) -> Any:
        """Return the next sample of the cell; while it is frozen, do not return."""
        self._faults.hold_up("cell_frozen")
        return self._cell.read(timeout_s=timeout_s)

    def close(self) -> None:
        """Release the serial line."""
        self._cell.close()
