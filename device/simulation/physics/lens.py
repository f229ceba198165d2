"""Radiance on the face to light on the pixels: magnification to non-square pixels, blur, vignetting.

Interpolation and blur are separable, so a frame costs two small matrix products; a lens that distorts costs one more
interpolation, on a grid twice as fine as the render grid.
Source: the cosine-fourth law of illumination (Born & Wolf, Principles of Optics, section 4.8.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, require
from device.measurement.recording.camera_geometry import RIM_MM
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Image

ACTION = "use a real lens's data sheet"
REACH = 4
"""Standard deviations of the blur that are kept."""
FINER = 2
"""Cells of the undistorted plane along one render cell."""


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


@dataclass(frozen=True)
class TrueCamera:
    """What the camera is against its certificate.

    Where the certificate says X (mm from the image's middle), the camera sees the face at R (1 + d (R / 11 mm)^2)
    + axis, with R = `scale_x_ratio` X and so in y, and d = `rim_distortion_percent` / 100: true pixel size over the
    certificate's, and where the optical axis meets the face. `further_blur_mm` is a standard deviation on the face.
    """

    scale_x_ratio: float = 1.0
    scale_y_ratio: float = 1.0
    axis_x_mm: float = 0.0
    axis_y_mm: float = 0.0
    rim_distortion_percent: float = 0.0
    further_blur_mm: float = 0.0

    def __post_init__(self) -> None:
        action = "name a camera that a builder may have fitted"
        for name in ("scale_x_ratio", "scale_y_ratio"):
            require(f"world.camera.{name}", getattr(self, name), Bound(0.9, 1.1, ""), action)
        for name in ("axis_x_mm", "axis_y_mm"):
            require(f"world.camera.{name}", getattr(self, name), Bound(-2.0, 2.0, "mm"), action)
        bound = Bound(-10.0, 10.0, "%")
        require("world.camera.rim_distortion_percent", self.rim_distortion_percent, bound, action)
        require("world.camera.further_blur_mm", self.further_blur_mm, Bound(0.0, 1.0, "mm"), action)

    @property
    def is_straight(self) -> bool:
        """Return whether lines of the face stay lines in the image."""
        return self.rim_distortion_percent == 0.0

    def seen_mm(
        self, x_mm: NDArray[np.floating], y_mm: NDArray[np.floating]
    ) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """Return where on the face, from the optical axis, points of the undistorted plane are; both broadcast."""
        farther = 1 + self.rim_distortion_percent / 100 * (x_mm**2 + y_mm**2) / RIM_MM**2
        return x_mm * farther, y_mm * farther


AS_CERTIFIED = TrueCamera()


class Projection:
    """Maps fields on one render grid to one camera's pixels."""

    def __init__(
        self,
        lens: Lens,
        x_mm: NDArray[np.floating],
        y_mm: NDArray[np.floating],
        shape: tuple[int, int],
        scale: PixelScale,
        camera: TrueCamera = AS_CERTIFIED,
    ) -> None:
        """The grid's coordinates are evenly spaced and ascend; pixels beyond it see its edge.

        `scale` is the certificate's; `camera` is what is true.
        """
        px_x, px_y = (axis.ravel() for axis in scale.coordinates_mm(shape))
        px_x, px_y = camera.scale_x_ratio * px_x, camera.scale_y_ratio * px_y
        blur_x, blur_y = (
            math.hypot(lens.blur_px, camera.further_blur_mm / pitch) for pitch in (scale.mm_per_px_x, scale.mm_per_px_y)
        )
        x_mm, y_mm = x_mm - camera.axis_x_mm, y_mm - camera.axis_y_mm
        self._straighten = None if camera.is_straight else _Straightened(camera, x_mm, y_mm)
        if self._straighten:
            x_mm, y_mm = self._straighten.x_mm, self._straighten.y_mm
        self._columns = _interpolation(x_mm, px_x, blur_x).T.copy()
        self._rows = _interpolation(y_mm, px_y, blur_y)
        self._fall_off = lens.fall_off(shape, scale)

    def __call__(self, radiance: Image) -> Image:
        """Return the light on the pixels [height, width] from a field [ny, nx]."""
        plane = np.asarray(radiance, dtype=np.float32)
        if self._straighten:
            plane = self._straighten(plane)
        image = self._rows @ plane @ self._columns
        image *= self._fall_off
        return np.asarray(image)


class _Straightened:
    """A field of the face on a finer grid of the plane in which the lens would not distort; bilinear."""

    def __init__(self, camera: TrueCamera, x_mm: NDArray[np.floating], y_mm: NDArray[np.floating]) -> None:
        self.x_mm, self.y_mm = (np.linspace(of[0], of[-1], FINER * (len(of) - 1) + 1) for of in (x_mm, y_mm))
        seen_x, seen_y = camera.seen_mm(self.x_mm[None, :], self.y_mm[:, None])
        (column, share_x), (row, share_y) = _cells(x_mm, seen_x), _cells(y_mm, seen_y)
        self._corner, self._row_step = row * len(x_mm) + column, len(x_mm)
        self._share_x, self._share_y = (np.asarray(share, np.float32) for share in (share_x, share_y))

    def __call__(self, field: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the field [ny, nx] on the finer grid."""
        upper, lower = (self._along_row(field.ravel(), self._corner + step) for step in (0, self._row_step))
        return np.asarray(upper + self._share_y * (lower - upper))

    def _along_row(self, flat: NDArray[np.float32], left: NDArray[np.intp]) -> NDArray[np.float32]:
        first = flat.take(left)
        return np.asarray(first + self._share_x * (flat.take(left + 1) - first))


def _cells(grid_mm: NDArray[np.floating], at_mm: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.floating]]:
    """Return the cell of an even grid that holds each place, and how far along it; beyond the grid its edge."""
    place = np.clip((at_mm - grid_mm[0]) / (grid_mm[1] - grid_mm[0]), 0, len(grid_mm) - 1)
    low = np.minimum(place.astype(np.intp), len(grid_mm) - 2)
    return low, place - low


def _interpolation(grid_mm: NDArray[np.floating], pixel_mm: Image, blur_px: float) -> NDArray[np.float32]:
    """Return the matrix [pixels, grid] of linear interpolation followed by the blur."""
    low, share = _cells(grid_mm, pixel_mm)
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
