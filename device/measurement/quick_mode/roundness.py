"""How far from round the bright spot is: the second harmonic of the contrast, against the most a round inclusion shows.

A round inclusion off the axis has a second harmonic too, so it is compared with the first. Source of the share: random
presses up to 2 mm off the axis; docs/modes.md counts how often inclusions that are not round, and pairs, are refused.
"""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array

OFFSETS_SHARE, NOISE_CONTRAST = 0.3, 0.004
"""The second harmonic of a round inclusion off the axis is at most this share of its first, and noise is this
contrast.
"""


def elongation_ratio(elongation: Array, offset: Array) -> float:
    """Return the second harmonic [J] over the most that a round inclusion as far off the axis shows.

    `offset` [J] is the first harmonic; of both the root mean square over the rings counts.
    """
    oblong, aside = (float(np.sqrt(np.mean(part**2))) for part in (elongation, offset))
    return oblong / (NOISE_CONTRAST + OFFSETS_SHARE * aside)
