"""Two presses on one bare block to how far their light differs smoothly: the error of the flat field, as a level.

An inclusion is seen as the light of its press over that of a press beside it. What differs between two presses where
there is no inclusion is an error of that, and no number of pixels takes out a smooth one (docs/accuracy.md). So the
level is measured and held against what the models believe in (`ErrorLevels.flat_field_ratio`).

Light over its mean over the face, in cells of a millimetre, so neither a force that is read wrong nor LEDs that fade
alike count. Each cell grows with the force in its own way, by a quadratic in its logarithm; by how much the second
press lies beside the first is left. Of that a plane is taken off: a probe that leans otherwise is no flat field, and
presses are fitted with a lean of their own. What noise alone would show is taken off, too, and what means and plane
take off a field of the length that the models believe in is put back: so it is a level in their sense.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, require
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Counts, Frame, full_scale

CELLS = 24, 16
"""Cells across and down the image: a millimetre each on the face."""
LIT_RATIO = 0.2
"""Cells below this part of the brightest one's light lie beyond the face or at its rim."""
FEWEST_FRAMES, FEWEST_CELLS = 4, 12
LEAST_COUNTS = 1.0
"""Light above dark, of 8 bits, of a cell that counts at all."""
LENGTH_MM = 2.0
"""That of `ErrorLevels.flat_field_mm`."""


class FlatFieldError(NamedTuple):
    """Standard deviation of the smooth difference of two presses over the light, and of what noise makes of it."""

    level_ratio: float
    noise_ratio: float


def flat_field_error(
    first: Sequence[Frame], second: Sequence[Frame], dark: Counts, scale: PixelScale, length_mm: float = LENGTH_MM
) -> FlatFieldError:
    """Return the level of two presses on one bare block, of frames under load in one light, and a dark one.

    The field's correlation is taken to be exp(-distance^2 / (2 length^2)).
    Raises `InvalidQuantity` for fewer than 4 frames of a press, a force that is not positive, or a face without light
    or with too much of it: cells with a saturated pixel tell nothing.
    """
    for frames in (first, second):
        require("frames of a press", len(frames), Bound(FEWEST_FRAMES, np.inf, ""), "press longer")
    force_n = np.array([frame.force_n for frame in (*first, *second)])
    require(
        "force_n of a press", float(force_n.min()), Bound(0.0, np.inf, "N", low_included=False), "tare, press again"
    )
    light = np.array([_cells(frame.counts) for frame in (*first, *second)]) - _cells(dark)
    mean = light.mean(axis=0)
    is_lit = (mean >= LIT_RATIO * mean.max()) & (light.min(axis=0) >= LEAST_COUNTS)
    is_lit &= ~np.any([_is_saturated(frame.counts) for frame in (*first, *second)], axis=0)
    require("lit cells of the face", int(is_lit.sum()), Bound(FEWEST_CELLS, np.inf, ""), "press harder, on the block")
    log_light = np.log(light[:, is_lit] / light[:, is_lit].mean(axis=1, keepdims=True))
    difference, noise_square = _difference(log_light, force_n, len(first))
    flat = _projector(is_lit)
    height, width = dark.shape
    cell_mm = width * scale.mm_per_px_x / CELLS[0], height * scale.mm_per_px_y / CELLS[1]
    seen = np.trace(flat @ _correlation(is_lit, cell_mm, length_mm)) / len(flat)
    of_noise = noise_square * np.trace(flat) / len(flat)
    square = max(float(np.mean((flat @ difference) ** 2)) - of_noise, 0.0)
    return FlatFieldError(float(np.sqrt(square / seen)), float(np.sqrt(of_noise / seen)))


def _is_saturated(counts: Counts) -> NDArray[np.bool_]:
    """Return which cells [16, 24] have a pixel that takes no more light."""
    is_full = np.asarray(counts >= full_scale(counts), np.float32)
    return np.asarray(cv2.resize(is_full, CELLS, interpolation=cv2.INTER_AREA) > 0)


def _difference(log_light: Array, force_n: Array, of_first: int) -> tuple[Array, float]:
    """Return by how much the later frames [F, cells] lie beside the first ones [cells], and the variance of that."""
    log_force = np.log(force_n) - np.log(force_n).mean()
    is_second = np.where(np.arange(len(force_n)) < of_first, -0.5, 0.5)
    design = np.column_stack([is_second, np.ones_like(log_force), log_force, log_force**2])
    inverse = np.linalg.pinv(design)
    fitted = inverse @ log_light
    freedom = max(len(design) - int(np.linalg.matrix_rank(design)), 1)
    variance = np.sum((log_light - design @ fitted) ** 2, axis=0) / freedom * np.sum(inverse[0] ** 2)
    return fitted[0], float(variance.mean())


def _cells(counts: Counts) -> Array:
    """Return the mean of each cell [16, 24], in counts of 8 bits."""
    of_8_bits = 1 if counts.dtype == np.uint8 else 256
    means = cv2.resize(np.asarray(counts, np.float32), CELLS, interpolation=cv2.INTER_AREA)
    return np.asarray(means, np.float64) / of_8_bits


def _projector(is_lit: NDArray[np.bool_]) -> Array:
    """Return the matrix [cells, cells] that takes mean and slopes along x and y off values of the lit cells."""
    y, x = np.nonzero(is_lit)
    plane, _ = np.linalg.qr(np.column_stack([np.ones(len(x)), x, y]))
    return np.asarray(np.eye(len(x)) - plane @ plane.T)


def _correlation(is_lit: NDArray[np.bool_], cell_mm: tuple[float, float], length_mm: float) -> Array:
    """Return the covariance [cells, cells] of the lit cells' means of a field of variance 1.

    A cell is taken for a Gaussian of its variance, along x and y: exact to the fourth power of cell over length.
    """
    covariance = np.ones((int(is_lit.sum()),) * 2)
    for cells, size_mm in zip(np.nonzero(is_lit)[::-1], cell_mm, strict=True):
        wider_mm2 = length_mm**2 + size_mm**2 / 6
        apart_mm = size_mm * (cells[:, None] - cells)
        covariance *= length_mm / np.sqrt(wider_mm2) * np.exp(-(apart_mm**2) / (2 * wider_mm2))
    return np.asarray(covariance)
