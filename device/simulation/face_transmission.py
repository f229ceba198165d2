"""How much light passes the face, by the angle it arrives at: Fresnel, averaged over the width of its source.

Total reflection at a dry face begins at one exact angle, but an LED is seen under a range of angles; without that
average the light that leaks out at slopes would have false, sharp edges. Source: Hecht, Optics, section 4.6.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float32]
LOWEST_COSINE = -0.2
COSINES, WIDTHS = 1200, 32
WIDEST = 0.16
"""Half-width of the range of cosines under which a source is seen; wider ones count as this."""
_ACROSS = 41


def transmission(cosine: NDArray[np.float64], n_from: float, n_to: float) -> NDArray[np.float64]:
    """Return the share of unpolarised light that passes an interface; 0 at total reflection and from behind."""
    c = np.clip(cosine, 0.0, 1.0)
    squared = 1 - (n_from / n_to) ** 2 * (1 - c**2)
    refracted = np.sqrt(np.maximum(squared, 0.0))
    with np.errstate(invalid="ignore"):
        perpendicular = (n_from * c - n_to * refracted) / (n_from * c + n_to * refracted)
        parallel = (n_to * c - n_from * refracted) / (n_to * c + n_from * refracted)
    passed = 1 - (perpendicular**2 + parallel**2) / 2
    return np.where((squared > 0) & (c > 0), passed, 0.0)


def diffuse_reflectance(n_from: float, n_to: float) -> float:
    """Return the reflected share of Lambertian light that arrives at an interface: the mean of R over cos^2."""
    squares = (np.arange(2000) + 0.5) / 2000
    return float(1 - transmission(np.sqrt(squares), n_from, n_to).mean())


@lru_cache(maxsize=4)
def passing(n_from: float, n_to: float) -> Array:
    """Return [COSINES * WIDTHS] the mean of cosine * transmission over a round source seen from a place.

    Row: cosine between the light's mean direction and the face's normal, from LOWEST_COSINE to 1. Column: half-width
    of the range of cosines, 0..WIDEST. A disc seen from its side is a semicircle's distribution. Kept, not made again,
    for an index that was asked for before.
    """
    cosine = np.linspace(LOWEST_COSINE, 1.0, COSINES)[:, None, None]
    width = np.linspace(0.0, WIDEST, WIDTHS)[None, :, None]
    angle = (np.arange(_ACROSS) + 0.5) * math.pi / _ACROSS
    weight = np.sin(angle) ** 2
    seen = np.clip(cosine + width * np.cos(angle), -1.0, 1.0)
    mean = (np.maximum(seen, 0.0) * transmission(seen, n_from, n_to) * weight).sum(axis=2) / weight.sum()
    table = np.asarray(mean.ravel(), dtype=np.float32)
    table.setflags(write=False)
    return table


def passing_index(cosine: Array, width: Array) -> NDArray[np.intp]:
    """Return where in the table of `passing` a cosine and a half-width of cosines are, to the nearest entry."""
    row = (cosine - np.float32(LOWEST_COSINE)) * np.float32((COSINES - 1) / (1 - LOWEST_COSINE)) + np.float32(0.5)
    column = width * np.float32((WIDTHS - 1) / WIDEST) + np.float32(0.5)
    row, column = np.clip(row, 0, COSINES - 1), np.minimum(column, WIDTHS - 1)
    return np.asarray(row.astype(np.intp) * WIDTHS + column.astype(np.intp))
