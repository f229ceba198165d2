"""The settings of the press: which force is held in which band, and what counts as contact, steady and too much.

Contact lies below the smallest force of every mode, and overload above the largest: a ramp has forces of its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from device.measurement.mode import MODES, RAMP_FROM_N, RAMP_TO_N, Mode
from device.measurement.quantities import Bound
from device.settings.setting import Conflict, Section, conflict, setting


@dataclass(frozen=True)
class PressSection(Section):
    """The press: mode unless asked otherwise, target force and its band, what is contact, steady, and too much."""

    prefix = "press."

    mode: Mode = setting("paper", "How a press is measured unless it is asked for in another mode.", choices=MODES)
    target_n: float = setting(0.5, "Force of a hold.", Bound(0.1, 20.0, "N"))
    band_ratio: float = setting(
        0.05, "Frames of a hold are taken this near to the target, as a part of it.", Bound(0.005, 0.2, "")
    )
    contact_n: float = setting(
        0.05, "Force that is contact, at most half the target.", Bound(0.005, 0.75 * RAMP_FROM_N, "N")
    )
    steady_n: float = setting(0.02, "Change of force within which a hold is steady.", Bound(0.001, 1.0, "N"))
    overload_n: float = setting(
        1.0, "Force that is too much, at least a fifth above the target.", Bound(1.2 * RAMP_TO_N, 50.0, "N")
    )
    max_rate_n_per_s: float = setting(
        0.35,
        "A ramp's force may not change faster, or it would not be known at the exposure.",
        Bound(0.05, 5.0, "N/s"),
    )
    max_offset_mm: float = setting(
        2.5,
        "An inclusion whose bright spot lies further off the middle of the face is off-centre: the press is rejected.",
        Bound(0.5, 30.0, "mm"),
    )
    timeout_s: float = setting(60.0, "A press that takes longer is given up.", Bound(1.0, 3600.0, "s"))

    def conflicts(self) -> Iterator[Conflict]:
        """Yield a contact that is too near to the target from below, and an overload from above."""
        contact = Bound(0.005, self.target_n / 2, "N, half the target")
        yield from conflict("press.contact_n", self.contact_n, contact, "press.target_n")
        overload = Bound(1.2 * self.target_n, 50.0, "N, a fifth above the target")
        yield from conflict("press.overload_n", self.overload_n, overload, "press.target_n")

    @property
    def band_n(self) -> tuple[float, float]:
        """Forces between which frames are taken."""
        return self.target_n * (1 - self.band_ratio), self.target_n * (1 + self.band_ratio)
