"""An unknown's value and 90 % interval as people read them: as many digits as the interval supports, never narrower.

One rule for paper, the hospital's archive and the screen (`device/web/static/result/quantities.js` has it, too): half
of the interval is three units of the last digit or more, and its ends are rounded outwards.
Source: JCGM 100:2008 (GUM), 7.2.6, which also lets a stated uncertainty be rounded up rather than to the nearest.
"""

from __future__ import annotations

import math
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

from device.measurement.quantities import unit_of

FEWEST_UNITS, MOST_DECIMALS = 3, 2
SAME = 1e-6
"""Of a last digit's unit: an end that lies so near a multiple of it is that multiple."""


def has_open_end(quantity: dict[str, Any]) -> bool:
    """Return whether an unknown may lie beyond an end of its interval, where nothing was tried."""
    return bool(quantity.get("low_is_open") or quantity.get("high_is_open"))


def shown_decimals(low: float, high: float) -> int:
    """Return how many decimals an interval supports, from none to two."""
    half = (high - low) / 2
    return next((d for d in range(MOST_DECIMALS) if half >= FEWEST_UNITS * 10.0**-d), MOST_DECIMALS)


def shown_value(quantity: dict[str, Any]) -> str:
    """Return the value of an unknown that has an interval, without its unit."""
    unit = Decimal(1).scaleb(-shown_decimals(quantity["low"], quantity["high"]))
    return str(Decimal(repr(float(quantity["value"]))).quantize(unit, ROUND_HALF_UP))  # of a tie up, as browsers do


def shown_interval(name: str, quantity: dict[str, Any]) -> str:
    """Return its interval with the unit: from where to where, or from which end on, or that any value is possible."""
    low, high = shown_ends(quantity["low"], quantity["high"])
    unit = unit_of(name)
    of_ends = {
        (False, False): f"{low} to {high} {unit}",
        (True, False): f"{high} {unit} or less",
        (False, True): f"{low} {unit} or more",
        (True, True): "any value",
    }
    return of_ends[bool(quantity.get("low_is_open")), bool(quantity.get("high_is_open"))]


def shown_ends(low: float, high: float) -> tuple[str, str]:
    """Return the ends of an interval, rounded outwards."""
    decimals = shown_decimals(low, high)
    units = 10.0**decimals
    ends = math.floor(low * units + SAME) / units, math.ceil(high * units - SAME) / units
    return f"{ends[0]:.{decimals}f}", f"{ends[1]:.{decimals}f}"


def shown_mean_and_spread(mean: float, spread: float) -> tuple[str, str]:
    """Return the mean of presses and their standard deviation, which has two digits that count, both to its decimals.

    Source: JCGM 100:2008 (GUM), 7.2.6: two digits are enough of a standard uncertainty.
    """
    exponent = int(f"{spread:.1e}".rpartition("e")[2])
    decimals = min(max(1 - exponent, 0), MOST_DECIMALS) if spread else MOST_DECIMALS
    return f"{mean:.{decimals}f}", f"{spread:.{decimals}f}"
