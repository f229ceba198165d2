"""Whether each LED lights its own side: of a face that is held on the reference block, each side lit alone.

The half of the image that is nearer to an LED is brighter than the opposite one, at the target force by a third; at a
tenth of it the far half is brighter, so the test needs the force. Where the block touches does not matter: each side's
light is compared with that of all sides together. An untouched face is dark by total reflection and tells nothing.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from device.instrument.self_test.result import Result, judged, not_tested
from device.measurement.led_sides import SIDES
from device.measurement.quantities import Bound
from device.measurement.tactile_image import Counts

PART = "Light"
OWN_SIDE = Bound(1.1, np.inf, "times")
"""Light in a side's own half over that in the opposite one.

The simulated probe has 1.3 (+x, -x) and 1.4 (+y, -y) at 0.5 N; swapped plugs have the inverse of it.
"""
BLOCK = "Repeat it with the probe held on the reference block: an untouched face is dark."


def untested_sides(remedy: str = BLOCK) -> list[Result]:
    """Return that no side was tested, and what it takes."""
    return [not_tested(PART, f"LED {side}", remedy) for side in SIDES]


def side_results(dark: Counts, lit: Sequence[Counts], ratio: Sequence[float], min_side_ratio: float) -> list[Result]:
    """Return one result a side, of frames [height, width]: without light, and each side alone at a brightness."""
    halves = np.array([(_halves(counts) - _halves(dark)) / part for counts, part in zip(lit, ratio, strict=True)])
    levels = np.maximum(halves.mean(axis=1), 0.0)
    fewest = Bound(min_side_ratio * float(levels.max()), np.inf, "counts", low_included=False)
    return [
        _side(number, halves) if fewest.holds(levels[number]) else _dark_side(number, levels[number], fewest)
        for number in range(len(SIDES))
    ]


def _side(number: int, halves: NDArray[np.float64]) -> Result:
    """Judge a side that gives light: `halves` [sides, halves] has each side's light in each half."""
    share = halves[number] / np.maximum(halves.sum(axis=0), 1e-6)
    opposite = (number + 2) % len(SIDES)
    own_ratio = share[number] / max(share[opposite], 1e-6)
    lights = int(np.argmax(share))
    remedy = "Hold it with its middle on the block and repeat the test."
    if lights != number:
        remedy = f"It lights {SIDES[lights]}: put the plugs of {SIDES[number]} and {SIDES[lights]} where they belong."
    return judged(PART, f"LED {SIDES[number]}", own_ratio, OWN_SIDE, remedy)


def _dark_side(number: int, level: float, fewest: Bound) -> Result:
    remedy = "It gives no light: check the LED board's cable; have the LED replaced."
    return judged(PART, f"LED {SIDES[number]}", level, fewest, remedy)


def _halves(counts: Counts) -> NDArray[np.float64]:
    """Return the mean counts of the right, lower, left and upper half, in the order of `SIDES`: +y is down."""
    height, width = counts.shape
    right, left = counts[:, -(width // 2) :], counts[:, : width // 2]
    lower, upper = counts[-(height // 2) :], counts[: height // 2]
    return np.array([half.mean() for half in (right, lower, left, upper)])
