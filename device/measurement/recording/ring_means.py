"""An image to a few numbers a ring: mean, and first and second harmonic of the angle, on soft rings of the face.

A ring's weight falls linearly from its radius to its neighbours', so that no pixel jumps from ring to ring and the
means do not depend on where the pixels happen to lie. Without the inclusion's direction only lengths of harmonics mean
something, so the first is taken along the direction of the bright side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Image

RING_MM = 0.9
RINGS = 11
"""Rings at 0, 0.9 ... 9.0 mm: the last ends where the central window does, at 0.9 of the face's radius."""
RING_RADII_MM: Array = RING_MM * np.arange(RINGS, dtype=np.float64)
MIDDLE = np.repeat([1 / 4, 0.0], [4, RINGS - 4])
"""Weights of the mean over the innermost rings."""
MIDDLE_LESS_RIM = MIDDLE - np.repeat([0.0, 1 / 3], [RINGS - 3, 3])
"""The same less the mean over the outermost ones: light that has drifted as a whole is not in it."""
HARMONICS = 2


class RingMeans(NamedTuple):
    """`mean` [..., J], and `cosine`, `sine` [..., 2, J] of the first two harmonics, in the image's own unit.

    The harmonics are those of what differs from the ring's mean: a ring that is seen in part has none by itself.
    """

    mean: Array
    cosine: Array
    sine: Array


@dataclass(frozen=True, eq=False)
class RingWeights:
    """The pixels inside the window, and their weights [5 J, pixels]: rings, and rings times each wave of the angle."""

    inside: NDArray[np.bool_]
    weight: Image

    def means(self, images: Image, valid: NDArray[np.bool_]) -> RingMeans:
        """Return the ring means over the valid pixels of images [..., height, width]; a ring without one is 0."""
        seen = valid[..., self.inside]
        values = np.where(seen, images[..., self.inside], np.float32(0))
        of_values, of_seen = self._sums(values), self._sums(seen.astype(np.float32))
        norm = np.maximum(of_seen[..., :1, :], np.float32(1e-6))
        mean = of_values[..., :1, :] / norm
        waves = (2 * (of_values - mean * of_seen) / norm)[..., 1:, :].astype(float)
        return RingMeans(mean[..., 0, :].astype(float), waves[..., :HARMONICS, :], waves[..., HARMONICS:, :])

    def _sums(self, pixels: Image) -> Image:
        """Return the sums [..., 5, J] of pixels [..., pixels] by all weights: one matrix product for all images."""
        return (pixels @ self.weight.T).reshape(*pixels.shape[:-1], 1 + 2 * HARMONICS, RINGS)


@lru_cache(maxsize=4)
def ring_weights(shape: tuple[int, int], scale: PixelScale) -> RingWeights:
    """Return the weights for images [height, width] of a pixel scale."""
    x, y = np.broadcast_arrays(*scale.coordinates_mm(shape))
    r = np.hypot(x, y)
    inside = r < RINGS * RING_MM
    angle = np.arctan2(y, x)[inside]
    order = np.arange(1, HARMONICS + 1)[:, None]
    distance = np.abs(r[inside][None, :] - RING_RADII_MM[:, None]) / RING_MM
    ring = np.maximum(1 - distance, 0)
    waves = np.concatenate([np.ones((1, angle.size)), np.cos(order * angle), np.sin(order * angle)])
    weight = (waves[:, None] * ring).reshape(-1, angle.size)
    return RingWeights(inside, weight.astype(np.float32))
