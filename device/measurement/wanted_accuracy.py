"""How sure a scan is asked to be: refused when it makes no sense or cannot be had, and compared with what there is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from device.measurement.mode import FRAMES, Mode, ModeWorth
from device.measurement.quantities import Bound, InvalidQuantity, require

UNTIL_BOUNDS = {
    "size_mm": Bound(0.0, 20.0, "mm", low_included=False),
    "depth_mm": Bound(0.0, 20.0, "mm", low_included=False),
    "youngs_modulus_kpa": Bound(0.0, 200.0, "kPa", low_included=False),
}
"""How sure an unknown may be asked to be: half of its 90 % interval. Wider than the trained ranges says nothing."""
WITHIN_BOUND = Bound(5.0, 300.0, "s")
"""In how many seconds; the shortest is one ramp of a hand that knows the probe."""


@dataclass(frozen=True)
class WantedAccuracy:
    """How sure a scan is asked to be before it ends by itself, and how long it may take; nothing is asked by default.

    `until`: half of the 90 % interval that is asked for, by unknown in its own unit. `within_s`: seconds from the first
    contact with the lesion. Raises `InvalidQuantity` for what is no number inside `UNTIL_BOUNDS` and `WITHIN_BOUND`.
    """

    until: Mapping[str, float] = field(default_factory=dict)
    within_s: float | None = None

    def __post_init__(self) -> None:
        for name, value in self.until.items():
            if name not in UNTIL_BOUNDS:
                raise InvalidQuantity("until", repr(name)[:80], f"of {', '.join(UNTIL_BOUNDS)}", "name an unknown")
            require(f"until.{name}", value, UNTIL_BOUNDS[name], "ask for half of the 90 % interval")
        if self.within_s is not None:
            require("within_s", self.within_s, WITHIN_BOUND, "give the seconds from the first contact with the lesion")

    @property
    def is_asked(self) -> bool:
        """Whether anything is asked for."""
        return bool(self.until) or self.within_s is not None

    def require_for(self, mode: Mode, worth: ModeWorth | None, press_s: float) -> None:
        """Raise `InvalidQuantity` for a mode that is no scan, or an accuracy that it cannot reach, with the nearest.

        `press_s`: what one press takes, which says how many there is time for. A mode whose worth does not say what it
        reaches takes everything.
        """
        if self.is_asked and not FRAMES[mode].is_scan:
            name, scan = "until" if self.until else "within_s", "asked for in mode precise"
            raise InvalidQuantity(name, f"asked for in mode {mode}", scan, "choose mode precise")
        reachable = self._reachable(mode, worth, press_s) if worth else {}
        for name, value in self.until.items():
            if value < reachable.get(name, 0.0):
                bound = Bound(reachable[name], UNTIL_BOUNDS[name].high, UNTIL_BOUNDS[name].unit)
                nearest = f"the nearest that can be had{self._in_time()} is {bound.low:g} {bound.unit}"
                raise InvalidQuantity(f"until.{name}", value, str(bound), nearest)

    def _in_time(self) -> str:
        return "" if self.within_s is None else f" within {self.within_s:g} s"

    def _reachable(self, mode: Mode, worth: ModeWorth, press_s: float) -> dict[str, float]:
        """Return the narrowest half widths of scans, of as many presses as there is time for.

        The one that is under way when the time is over still counts.
        """
        reachable = dict(worth.reachable_half_width or {})
        if self.within_s is None:
            return reachable
        fewest, most = FRAMES[mode].fewest_ramps, FRAMES[mode].most_ramps
        ramps = min(max(1 + int(self.within_s / press_s), fewest), most)
        of_ramps = worth.half_width_by_ramps.get(ramps, {})
        return reachable | {name: max(widths[0], reachable.get(name, 0.0)) for name, widths in of_ramps.items()}

    def is_reached(self, half_width: Mapping[str, float]) -> bool | None:
        """Return whether intervals are as narrow as was asked for; None when nothing was asked."""
        if not self.until:
            return None
        return all(half_width.get(name, math.inf) <= value for name, value in self.until.items())
