"""A tactile image to the paper's three numbers O1'-O3': value at the centroid, sum, and area over a threshold.

Areas are in mm2 and the sum is an integral over mm2, since the camera's pixels are not square. The threshold is half
of the image's own peak: it then does not move when light or skin do. Source: Lee & Won 2013, section III;
docs/measurement.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, require
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Image, TactileImage

FEATURE_NAMES = ("centroid_intensity", "total_intensity", "bright_area_mm2")


@dataclass(frozen=True)
class FeatureSettings:
    """What the definitions leave open; part of a calibration, since regressions hold for one choice only."""

    window_radius_mm: float = 9.9
    smoothing_mm: float = 0.5
    threshold_ratio: float = 0.5

    def __post_init__(self) -> None:
        action = "use the settings of a calibration"
        require("window_radius_mm", self.window_radius_mm, Bound(1.0, 100.0, "mm"), action)
        require("smoothing_mm", self.smoothing_mm, Bound(0.05, 5.0, "mm"), action)
        require("threshold_ratio", self.threshold_ratio, Bound(0.05, 0.95, ""), action)


@dataclass(frozen=True)
class Features:
    """The three features, and where the bright spot's centroid lies from the middle of the image (mm)."""

    centroid_intensity: float
    total_intensity: float
    bright_area_mm2: float
    centroid_x_mm: float
    centroid_y_mm: float

    def as_row(self) -> NDArray[np.float64]:
        """Return the features in the order of `FEATURE_NAMES`."""
        return np.array([self.centroid_intensity, self.total_intensity, self.bright_area_mm2])


def extract_features(image: TactileImage, settings: FeatureSettings) -> Features:
    """Return the features inside the central window, where the face is not singular and the pixel is valid."""
    image = _binned(image)
    x, y = image.scale.coordinates_mm(image.contrast.shape)
    window = image.valid & (x**2 + y**2 <= settings.window_radius_mm**2)
    smooth = _smoothed(image, settings.smoothing_mm)
    peak = float(smooth[window].max(initial=0.0))
    bright = window & (smooth > settings.threshold_ratio * peak)
    weight = np.where(bright, smooth, 0.0)
    total_weight = float(weight.sum())
    if total_weight <= 0.0:
        return Features(0.0, _integral(image, window), 0.0, 0.0, 0.0)
    centroid_x, centroid_y = float((weight * x).sum()) / total_weight, float((weight * y).sum()) / total_weight
    row = int(np.abs(y[:, 0] - centroid_y).argmin())
    column = int(np.abs(x[0] - centroid_x).argmin())
    return Features(
        centroid_intensity=float(smooth[row, column]),
        total_intensity=_integral(image, window),
        bright_area_mm2=float(np.count_nonzero(bright)) * image.scale.area_mm2,
        centroid_x_mm=centroid_x,
        centroid_y_mm=centroid_y,
    )


def _binned(image: TactileImage) -> TactileImage:
    """Return the image of 2 x 2 pixel means: the blur that follows is wider by far, and costs a seventh on it."""
    height, width = (side // 2 * 2 for side in image.contrast.shape)
    size = width // 2, height // 2
    contrast = cv2.resize(image.contrast[:height, :width], size, interpolation=cv2.INTER_AREA)
    valid = cv2.resize(image.valid[:height, :width].astype(np.float32), size, interpolation=cv2.INTER_AREA)
    scale = PixelScale(2 * image.scale.mm_per_px_x, 2 * image.scale.mm_per_px_y)
    return TactileImage(contrast, valid == 1.0, scale, image.force_n)


def _integral(image: TactileImage, window: NDArray[np.bool_]) -> float:
    return float(image.contrast[window].sum(dtype=np.float64)) * image.scale.area_mm2


def _smoothed(image: TactileImage, sigma_mm: float) -> Image:
    """Blur over valid pixels only: blurred contrast over blurred mask, so that dark corners do not pull."""
    mask = image.valid.astype(np.float32)
    weight = _blur(mask, sigma_mm, image.scale)
    blurred = _blur(image.contrast * mask, sigma_mm, image.scale)
    return np.divide(blurred, weight, out=np.zeros_like(blurred), where=weight > 0.01)


def _blur(values: Image, sigma_mm: float, scale: PixelScale) -> Image:
    sigma_x_px, sigma_y_px = sigma_mm / scale.mm_per_px_x, sigma_mm / scale.mm_per_px_y
    return np.asarray(cv2.GaussianBlur(values, (0, 0), sigmaX=sigma_x_px, sigmaY=sigma_y_px))
