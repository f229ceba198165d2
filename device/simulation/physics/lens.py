"""Radiance on the face to light on the pixels: magnification to non-square pixels, blur, vignetting.

Interpolation and blur are separable, so a frame costs two small matrix products.
Source: the cosine-fourth law of illumination (Born & Wolf, Principles of Optics, section 4.8.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, require
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Image

ACTION = "use a real lens's data sheet"
REACH = 4
"""Standard deviations of the blur that are kept."""


@dataclass(frozen=True)
class Lens:
    """Blur in pixels (standard deviation), and the distance over which the field falls off; 0: none of either."""

    blur_px: float = 0.7
    distance_mm: float = 24.0
    vignetting: bool = True

    def __post_init__(self) -> None:
        require("lens.blur_px", self.blur_px, Bound(0.0, 20.0, "px"), ACTION)
        require("lens.distance_mm", self.distance_mm, Bound(1.0, 1e4, "mm"), ACTION)

    def fall_off(self, shape: tuple[int, int], scale: PixelScale) -> NDArray[np.float32]:
        """Return the light of each pixel [height, width] over that of the middle, cos^4 of its field angle."""
        if not self.vignetting:
            return np.ones(shape, dtype=np.float32)
        x_mm, y_mm = scale.coordinates_mm(shape)
        return np.asarray((1 + (x_mm**2 + y_mm**2) / self.distance_mm**2) ** -2, dtype=np.float32)


class Projection:
    """Maps fields on one render grid to one camera's pixels."""

    def __init__(
        self,
        lens: Lens,
        x_mm: NDArray[np.floating],
        y_mm: NDArray[np.floating],
        shape: tuple[int, int],
        scale: PixelScale,
    ) -> None:
        """The grid's coordinates are evenly spaced and ascend; pixels beyond it see its edge."""
        px_x, px_y = scale.coordinates_mm(shape)
        self._columns = _interpolation(x_mm, px_x.ravel(), lens.blur_px).T.copy()
        self._rows = _interpolation(y_mm, px_y.ravel(), lens.blur_px)
        self._fall_off = lens.fall_off(shape, scale)

    def __call__(self, radiance: Image) -> Image:
        """Return the light on the pixels [height, width] from a field [ny, nx]."""
        image = self._rows @ np.asarray(radiance, dtype=np.float32) @ self._columns
        image *= self._fall_off
        return np.asarray(image)


def _interpolation(grid_mm: NDArray[np.floating], pixel_mm: Image, blur_px: float) -> NDArray[np.float32]:
    """Return the matrix [pixels, grid] of linear interpolation followed by the blur."""
    place = np.clip((pixel_mm - grid_mm[0]) / (grid_mm[1] - grid_mm[0]), 0, len(grid_mm) - 1)
    low = np.minimum(place.astype(int), len(grid_mm) - 2)
    share = place - low
    matrix = np.zeros((len(pixel_mm), len(grid_mm)))
    rows = np.arange(len(pixel_mm))
    matrix[rows, low], matrix[rows, low + 1] = 1 - share, share
    return np.asarray(_blurred(matrix, blur_px), dtype=np.float32)


def _blurred(matrix: NDArray[np.float64], blur_px: float) -> NDArray[np.float64]:
    if blur_px == 0:
        return matrix
    reach = math.ceil(REACH * blur_px)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / blur_px) ** 2)
    padded = np.pad(matrix, ((reach, reach), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, len(kernel), axis=0)
    return np.asarray(windows @ (kernel / kernel.sum()))
