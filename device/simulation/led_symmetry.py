"""One LED's light to that of all four: the block looks the same after a quarter turn.

Maps are [..., y, x] with ascending coordinates; the first LED is the one at +x, then +y, -x, -y.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
LEDS = 4


def quarter_turn(field: NDArray[Any]) -> NDArray[Any]:
    """Return a map of numbers [..., n, n] of one LED as that of the next one, a quarter turn from x to y."""
    return np.swapaxes(field[..., ::-1, :], -1, -2)


def turn_vectors(field: NDArray[Any]) -> NDArray[Any]:
    """Return a map of vectors [..., 3, m, n, n] of one LED as that of the next one."""
    x, y, z = np.moveaxis(quarter_turn(field), -4, 0)
    return np.stack([-y, x, z], axis=-4)


def four_leds(field: NDArray[np.floating]) -> Array:
    """Return a map of numbers [...] of the LED at +x for all LEDs [4, ...] as float32."""
    maps: list[NDArray[Any]] = [field]
    for _ in range(LEDS - 1):
        maps.append(quarter_turn(maps[-1]))
    return np.stack(maps).astype(np.float32)


def four_led_vectors(field: NDArray[np.floating]) -> Array:
    """Return a map of vectors [..., 3, m, n, n] of the LED at +x for all LEDs [4, ...] as float32."""
    maps: list[NDArray[Any]] = [field]
    for _ in range(LEDS - 1):
        maps.append(turn_vectors(maps[-1]))
    return np.stack(maps).astype(np.float32)
