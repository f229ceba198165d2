"""Light of the sides in one press to their brightness in the next: the lit reference frame keeps its level.

Reference and lesion press share one brightness, so it changes between presses only. What is remembered is the ratio
that was really set, never a sum of errors: at a limit nothing winds up, and when the light is back so is the ratio.
Source: integrator windup, Astrom & Murray, "Feedback Systems" (2008), section 10.4.
"""

from __future__ import annotations

from device.errors import LightLimitError
from device.instrument.acquisition.light_check import FEWEST_COUNTS, Levels
from device.measurement.recording.led_sides import SIDES, LedRatio

LOWEST_RATIO, HIGHEST_RATIO = 0.05, 1.0
"""Below a twentieth, a step of an 8-bit brightness is more than 8 % of it."""
MOST_CHANGE = 1.5
"""A press may be wrong, by a finger under the probe or a wet face: it moves the light by no more than this factor."""
SHORT_RATIO = 0.98
"""A limited side that gives this part of its share is not worth a word: rounding to 8 bits is 0.4 %."""


class BrightnessLoop:
    """`ratio`: the brightness of the four sides for the next press, each 0..1 of full scale."""

    def __init__(self, ratio: LedRatio, target_counts: float | None) -> None:
        """Start from a brightness; without a target (mean counts above dark of a lit frame) it stays."""
        self.ratio, self._target_counts = ratio, target_counts

    def saw(self, levels: Levels) -> LightLimitError | None:
        """Take the light of each side alone (counts at full brightness, target force) from the press of `ratio`.

        Each side that gives light is to give an equal share of the target; a dead one keeps its brightness.
        Returns a warning when a side is at an end of its range and its share is missed all the same.
        """
        alive = [level >= FEWEST_COUNTS for level in levels]
        if self._target_counts is None or not any(alive):
            return None
        share_counts = self._target_counts / sum(alive)
        wanted = [share_counts / level if lives else 0.0 for level, lives in zip(levels, alive, strict=True)]
        plus_x, plus_y, minus_x, minus_y = (
            _stepped(now, aim) if lives else now for now, aim, lives in zip(self.ratio, wanted, alive, strict=True)
        )
        self.ratio = plus_x, plus_y, minus_x, minus_y
        return self._warning(wanted)

    def _warning(self, wanted: list[float]) -> LightLimitError | None:
        """Return which sides cannot give their share: more than full brightness, or less than the lowest."""
        missed = {
            side: ratio / aim
            for side, ratio, aim in zip(SIDES, self.ratio, wanted, strict=True)
            if (ratio == HIGHEST_RATIO and ratio < SHORT_RATIO * aim)
            or (aim and ratio == LOWEST_RATIO and SHORT_RATIO * ratio > aim)
        }
        if not missed:
            return None
        told = " and ".join(f"{side} gives {part:.0%} of its share" for side, part in missed.items())
        cause = f"The light cannot hold its level of {self._target_counts:g} counts: {told}."
        return LightLimitError(cause, "Wipe the face; if it stays, have the LED replaced or set light.target_counts.")


def _stepped(now: float, aim: float) -> float:
    """Return the brightness nearest to an aim that one press may set."""
    stepped = min(max(aim, now / MOST_CHANGE), now * MOST_CHANGE)
    return min(max(stepped, LOWEST_RATIO), HIGHEST_RATIO)
