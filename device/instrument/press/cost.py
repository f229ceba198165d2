"""What a press of a mode costs: frames, the forces at which they are taken, and how long the hand is busy with them.

The time is that of one press, of the two that make a measurement, from when its first frame may be taken; computing
the answer comes on top. Measured error and time of each mode: docs/modes.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from device.config import Config
from device.instrument.press.machine import STEADY_WINDOW_S
from device.measurement.mode import FRAMES, RAMP_FROM_N, RAMP_TO_N, Mode

EASY_RATIO = 0.5
"""A hand that is not driven takes this part of the largest rate of a ramp."""


@dataclass(frozen=True)
class PressCost:
    """One mode: `frames` of each press, at one force (from_n = to_n) or over a ramp, and `seconds` of one press."""

    mode: Mode
    frames: int
    kind: Literal["hold", "ramp"]
    from_n: float
    to_n: float
    seconds: float


def press_cost(mode: Mode, config: Config) -> PressCost:
    """Return what a press of a mode costs on a probe with these settings."""
    press, frames = config.press, FRAMES[mode].count
    frames_s = frames / config.camera.frame_rate_hz
    if FRAMES[mode].is_ramp:
        ramp_s = (RAMP_TO_N - RAMP_FROM_N) / (EASY_RATIO * press.max_rate_n_per_s)
        return PressCost(mode, frames, "ramp", RAMP_FROM_N, RAMP_TO_N, round(max(ramp_s, frames_s), 1))
    return PressCost(mode, frames, "hold", press.target_n, press.target_n, round(STEADY_WINDOW_S + frames_s, 1))
