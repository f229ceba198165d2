"""A recording of held presses to one row: the contrast on rings of the face at one force, and that force.

What mode quick reads: one frame beside the lesion and one on it are enough. Frames are binned before they are divided,
as in `radial_profile`, and the reference light follows the power law that a hold has.

How far from round the bright spot is, its second harmonic tells. A round inclusion off the axis has one too, so it is
compared with the first. Source of the share: random presses up to 2 mm off the axis; docs/modes.md counts how often
inclusions that are not round, and pairs, are refused.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.ramp_modes.radial_profile import FLOOR_COUNTS, harmonic, rings_of
from device.measurement.recording.frame_light import lights_of
from device.measurement.recording.recording import Recording
from device.measurement.recording.reference_light import reference_light
from device.measurement.recording.ring_means import RING_RADII_MM

QUICK_FORCES_N = 0.44, 0.56
"""Mean forces of a hold that the network has learnt from; `press.target_n` is 0.5 N."""
AGAIN = "hold 0.5 N beside the lesion and on it"
QUICK_NAMES = (*(f"contrast_{r:.1f}_mm" for r in RING_RADII_MM), "force_n")

OFFSETS_SHARE, NOISE_CONTRAST = 0.3, 0.004
"""The second harmonic of a round inclusion off the axis is at most this share of its first, and noise is this
contrast.
"""


class QuickPress(NamedTuple):
    """Contrast on the rings and mean force [12], in the order of `QUICK_NAMES`; and `elongation_ratio`."""

    row: Array
    elongation_ratio: float


def quick_press(recording: Recording) -> QuickPress:
    """Return what a recording shows, mean over its press frames.

    Raises `InvalidQuantity` when a role is missing or a press was not held within `QUICK_FORCES_N`.
    """
    reference, press = lights_of(recording)
    for name, force_n in (("reference", reference.force_n), ("press", press.force_n)):
        if not len(force_n):
            raise InvalidQuantity(f"{name} frames", 0, "at least one", AGAIN)
        require(f"mean {name} force", float(np.mean(force_n)), Bound(*QUICK_FORCES_N, "N"), AGAIN)
    light = reference_light(list(reference.force_n), list(reference.images), FLOOR_COUNTS)
    rings = rings_of(press, light)
    row = np.append(rings.mean.mean(axis=0), np.mean(press.force_n))
    return QuickPress(row, elongation_ratio(harmonic(rings, 2), harmonic(rings, 1)))


def elongation_ratio(elongation: Array, offset: Array) -> float:
    """Return the second harmonic [J] over the most that a round inclusion as far off the axis shows.

    `offset` [J] is the first harmonic; of both the root mean square over the rings counts.
    """
    oblong, aside = (float(np.sqrt(np.mean(part**2))) for part in (elongation, offset))
    return oblong / (NOISE_CONTRAST + OFFSETS_SHARE * aside)
