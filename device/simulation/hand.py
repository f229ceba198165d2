"""The virtual operator's hand: it reads the screen's guidance and follows it, late and with a tremor.

A hand moves its force at a limited rate towards what it wants, so the force is a function of time that light, image
and load cell can all ask for. Physiological tremor: 8-12 Hz (Elble & Randall, 1978), plus a slow drift.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from threading import Lock

from device.measurement.quantities import Bound, require

BESIDE_MM = (40.0, 0.0)
"""Where the hand presses for the reference: far enough that the lump is not felt."""
ON_LESION_MM = (0.0, 0.0)
ACTION = "describe a human hand"


@dataclass(frozen=True)
class HandSettings:
    """How this operator presses."""

    rate_n_per_s: float = 0.45
    reaction_s: float = 0.25
    aim_n: float = 0.5
    tremor_n: float = 0.002
    drift_n: float = 0.006

    def __post_init__(self) -> None:
        require("hand.rate_n_per_s", self.rate_n_per_s, Bound(0.01, 10.0, "N/s"), ACTION)
        require("hand.reaction_s", self.reaction_s, Bound(0.0, 5.0, "s"), ACTION)
        require("hand.aim_n", self.aim_n, Bound(0.0, 5.0, "N"), ACTION)
        require("hand.tremor_n", self.tremor_n, Bound(0.0, 1.0, "N"), ACTION)
        require("hand.drift_n", self.drift_n, Bound(0.0, 1.0, "N"), ACTION)


class VirtualHand:
    """Force (N) and position (mm) over time."""

    def __init__(self, settings: HandSettings) -> None:
        self.settings = settings
        self._lock = Lock()
        self._since_s, self._from_n, self._aim_n = 0.0, 0.0, 0.0
        self._position_mm, self._next_position_mm = BESIDE_MM, BESIDE_MM
        self._following = False

    def begin(self) -> None:
        """Take up the probe: from now on the hand follows the guidance."""
        self._following = True

    def follow(self, guidance: str, now_s: float) -> None:
        """Read one line of guidance (its code) and act on it after the reaction time."""
        if not self._following:
            return
        act_s = now_s + self.settings.reaction_s
        match guidance:
            case "press_beside":
                self._aim(act_s, self.settings.aim_n, BESIDE_MM)
            case "press_lesion":
                self._aim(act_s, self.settings.aim_n, ON_LESION_MM)
            case "lift":
                self._aim(act_s, 0.0, None)
            case "done" | "rejected" | "fault":
                self._aim(act_s, 0.0, None)
                self._following = False

    def _aim(self, act_s: float, aim_n: float, position_mm: tuple[float, float] | None) -> None:
        force_n = self._steady_n(act_s)
        with self._lock:
            self._since_s, self._from_n, self._aim_n = act_s, force_n, aim_n
            self._position_mm = position_mm or self._position_mm

    def _steady_n(self, t_s: float) -> float:
        with self._lock:
            step_n = self.settings.rate_n_per_s * max(t_s - self._since_s, 0.0)
            gap_n = self._aim_n - self._from_n
            return self._from_n + math.copysign(min(step_n, abs(gap_n)), gap_n)

    def force_n(self, t_s: float) -> float:
        """Return the force on the probe: the steady part, and tremor in proportion to how hard it is held."""
        steady_n = self._steady_n(t_s)
        if steady_n <= 0.0:
            return 0.0
        held = min(steady_n / 0.1, 1.0)
        tremor = math.sin(2 * math.pi * 9.3 * t_s) + 0.5 * math.sin(2 * math.pi * 11.1 * t_s + 1.0)
        drift = math.sin(2 * math.pi * 0.4 * t_s) + 0.4 * math.sin(2 * math.pi * 1.1 * t_s + 2.0)
        return max(0.0, steady_n + held * (self.settings.tremor_n * tremor + self.settings.drift_n * drift))

    def position_mm(self, t_s: float) -> tuple[float, float]:
        """Return where the probe stands relative to the lesion; it moves only while it is lifted."""
        return self._position_mm
