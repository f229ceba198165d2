"""One seed to many that share no random number: one for each purpose, and one for each press of it.

Neighbouring whole numbers must not be handed out, or training with seed 30 would see the presses that another part of
training with seed 10 is judged on. Source: NumPy, "Parallel random number generation" (`SeedSequence`).
"""

from __future__ import annotations

import numpy as np

PRESSES = 100_000
"""Seeds of the presses of one purpose lie in a block of so many."""


def derived_seed(seed: int, purpose: str) -> int:
    """Return the seed (0 to 2**32 - 1) of one purpose under a whole number from 0."""
    return int(np.random.SeedSequence([seed, *purpose.encode()]).generate_state(1)[0])


def press_seed(seed: int, number: int) -> int:
    """Return the seed of one press, number 0 to 99 999, of a purpose."""
    return PRESSES * seed + number
