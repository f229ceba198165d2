"""Whether the light is what the LED chip's registers say, judged by frames alone.

An untouched face is nearly dark whatever the LEDs do: total reflection keeps their light inside. So each side is lit
alone under the load of the reference press, where its light comes out; there a dead side is black beside the others
and one that cannot be switched off shines in a dark frame. Source: frustrated total reflection, Han, UIST 2005.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.errors import AmbientLightError, DarkSideError, DimLightError, NoContrastError, StuckLightError
from device.measurement.recording.led_sides import SIDES
from device.measurement.recording.reference_light import reference_light
from device.measurement.recording.tactile_image import Counts, Frame

ONE_SIDED = 1.3
"""Light that is so much stronger in one half than in the other comes from a side of the waveguide."""
FEWEST_COUNTS = 2.0
"""Mean light above dark below which nothing is told about a side or a press."""
FIRST_PRESSES = 3
"""So many presses since the start say how bright a side is, when commissioning did not."""

Levels = tuple[float, ...]
"""Mean counts above dark of each side alone, at full brightness, in the order of `SIDES`."""


def level_counts(frame: Frame) -> float:
    """Return the mean counts of a frame."""
    return float(np.mean(frame.counts))


def require_dark(frame: Frame, max_dark_counts: float) -> None:
    """Raise `StuckLightError` or `AmbientLightError` when a frame taken without light is not dark.

    `max_dark_counts` includes the black level. Light from one side is called a stuck side, even light foreign.
    """
    level = level_counts(frame)
    if level <= max_dark_counts:
        return
    seen = f"A frame without light has {level:.0f} counts, above {max_dark_counts:g}"
    side, ratio = _brighter_side(frame.counts)
    if ratio >= ONE_SIDED:
        cause = f"{seen}, and is {ratio:.1f} times brighter at {SIDES[side]}: that side cannot be switched off."
        raise StuckLightError(cause, "Have the LED board repaired; do not measure.")
    cause = f"{seen}, everywhere: foreign light reaches the camera."
    raise AmbientLightError(cause, "Shade the probe, and check that its housing is closed.")


def _brighter_side(counts: Counts) -> tuple[int, float]:
    """Return the side with the largest ratio of its half's counts to the opposite half's, and that ratio.

    +y is down, as in the image. The black level stays in: it is not known, and makes the ratio smaller, never larger.
    """
    height, width = counts.shape
    left, right = counts[:, : width // 2].mean(), counts[:, -(width // 2) :].mean()
    top, bottom = counts[: height // 2].mean(), counts[-(height // 2) :].mean()
    light = np.maximum([right, bottom, left, top], 1e-6)
    ratio = light / np.roll(light, 2)
    return int(np.argmax(ratio)), float(np.max(ratio))


def growth_ratio(press: Sequence[Frame], dark_counts: float, from_n: float, to_n: float) -> float:
    """Return the light at one force over that at another, as the frames of a press show it; 1 without light.

    Forces in N, near those of the frames: a hold gives a power of the force, a ramp a curve through its frames.
    """
    levels = [np.array([[level_counts(frame) - dark_counts]], dtype=np.float32) for frame in press]
    light = reference_light([frame.force_n for frame in press], levels, FEWEST_COUNTS)
    before, after = (float(light.at(force_n)[0, 0]) for force_n in (from_n, to_n))
    return after / before if min(before, after) >= FEWEST_COUNTS else 1.0


def require_every_side(levels: Levels, min_side_ratio: float) -> None:
    """Raise `DarkSideError` when a side gives less than `min_side_ratio` of the brightest one's light, or all none."""
    brightest = max(levels)
    dark = [
        side
        for side, level in zip(SIDES, levels, strict=True)
        if brightest < FEWEST_COUNTS or level < min_side_ratio * brightest
    ]
    if dark:
        measured = ", ".join(f"{side} {level:.1f}" for side, level in zip(SIDES, levels, strict=True))
        cause = f"No light from {' and '.join(dark)} although it is switched on (counts of each side: {measured})."
        raise DarkSideError(cause, "Check the LED board's cable; have the LED replaced.")


class DimmingWatch:
    """Compares each side's light with that of commissioning, else with that of the first presses since the start.

    Skin reflects differently from person to person, so against the first presses a change of patient looks
    like dimming: it is a warning, and the commissioned levels hold on the phantom they were taken on.
    """

    def __init__(self, max_dimming_ratio: float, commissioned: Levels | None) -> None:
        self._max_dimming_ratio, self._commissioned = max_dimming_ratio, commissioned
        self._first: list[Levels] = []

    def warning(self, levels: Levels) -> DimLightError | None:
        """Return the warning that these levels deserve, or None."""
        expected = self._commissioned or (np.mean(self._first, axis=0) if self._first else None)
        lost = 1 - np.divide(levels, expected) if expected is not None else np.zeros(len(levels))
        if max(lost) <= self._max_dimming_ratio:
            if len(self._first) < FIRST_PRESSES:
                self._first.append(levels)
            return None
        dim = " and ".join(
            f"{side} {part:.0%}" for side, part in zip(SIDES, lost, strict=True) if part > self._max_dimming_ratio
        )
        cause = f"The light is dimmer than it was: {dim}, above {self._max_dimming_ratio:.0%}."
        return DimLightError(cause, "Wipe the face; if it stays, calibrate the probe or have the LED replaced.")


def require_contrast(touch: Frame, held: Sequence[Frame], dark_counts: float, min_contrast_ratio: float) -> None:
    """Raise `NoContrastError` when the light of a press has not come with its force.

    `touch` is a frame at a small force, `held` those at the target. Compared is the slope of light over force with the
    light that is there: 1 when light is proportional to force, 0 when gel or sweat couples it at the first touch.
    A press that gives no light at all is not judged: its sides are dark.
    """
    light = float(np.mean([level_counts(frame) for frame in held])) - dark_counts
    force_n = float(np.mean([frame.force_n for frame in held]))
    if light < FEWEST_COUNTS:
        return
    rise = light - (level_counts(touch) - dark_counts)
    contrast = rise / light * force_n / (force_n - touch.force_n)
    if contrast < min_contrast_ratio:
        cause = f"The image hardly depends on the force: {contrast:.0%} of its light, below {min_contrast_ratio:.0%}."
        raise NoContrastError(cause, "Wipe gel and sweat off face and skin, and press again.")
