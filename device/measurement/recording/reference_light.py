"""The inclusion-free press to the light it would give at any force: the flat field of every press frame.

No hand holds two presses equally hard. A hand that holds one force shows, by its tremor, the power of the force with
which light grows; a hand that presses slowly harder shows the growth itself, and every pixel gets its own.
Source: docs/measurement.md (why a straight line through the untouched face will not do).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.mode import RAMP_RATIO

Image = NDArray[np.float32]

TOUCHED_RATIO = 0.1
"""Reference frames above this part of the largest reference force are the press; the others show an untouched face."""
RAMP_DEGREE = 4
BEYOND_RATIO = 0.75, 1.1
"""How far beyond the smallest and the largest force of a ramp its polynomial is followed."""
EXPONENT, EXPONENT_SPREAD, LIGHT_NOISE = 0.65, 0.3, 1e-3
"""d ln(light) / d ln(force) before a frame is seen, how far off that may be, and how exact a frame's light is."""


@dataclass(frozen=True)
class HeldLight:
    """Light above dark at `force_n`, and the one power of the force with which all of it grows."""

    light: Image
    force_n: float
    exponent: float

    def at(self, force_n: float) -> Image:
        """Return the light above dark at a force (counts)."""
        if self.exponent == 0.0 or force_n <= 0.0:
            return self.light
        return self.light * np.float32((force_n / self.force_n) ** self.exponent)


@dataclass(frozen=True)
class RampLight:
    """Coefficients [k, height, width] of each pixel's polynomial in the force over `largest_n`."""

    coefficients: Image
    smallest_n: float
    largest_n: float

    def at(self, force_n: float) -> Image:
        """Return the light above dark at a force (counts); far beyond the ramp it stays what it is there."""
        low, high = BEYOND_RATIO
        held_n = min(max(force_n, low * self.smallest_n), high * self.largest_n)
        powers = np.float32(held_n / self.largest_n) ** np.arange(len(self.coefficients), dtype=np.float32)
        return np.asarray(np.tensordot(powers, self.coefficients, 1), dtype=np.float32)


def reference_light(force_n: Sequence[float], lit: Sequence[Image], floor_counts: float) -> HeldLight | RampLight:
    """Return the light of reference frames [height, width] above dark (counts), each with its force (N).

    Only pixels from `floor_counts` on tell the power of a held press.
    """
    largest_n = max(force_n)
    if largest_n <= 0.0:
        return HeldLight(_mean(lit), force_n=0.0, exponent=0.0)
    touched = [i for i, force in enumerate(force_n) if force >= TOUCHED_RATIO * largest_n]
    forces, frames = np.array([force_n[i] for i in touched]), [lit[i] for i in touched]
    if largest_n >= RAMP_RATIO * forces.min() and len(frames) > RAMP_DEGREE:
        return _ramp(forces, frames)
    light, log_force = _mean(frames), np.log(forces)
    return HeldLight(light, float(np.exp(log_force.mean())), _exponent(log_force, light, frames, floor_counts))


def _mean(frames: Sequence[Image]) -> Image:
    return np.asarray(np.mean(frames, axis=0, dtype=np.float32))


def _ramp(forces_n: NDArray[np.float64], frames: Sequence[Image]) -> RampLight:
    """Fit every pixel's polynomial by least squares; all pixels share one small matrix."""
    largest_n = float(forces_n.max())
    weights = np.linalg.pinv(np.vander(forces_n / largest_n, RAMP_DEGREE + 1, increasing=True)).astype(np.float32)
    coefficients = np.zeros((RAMP_DEGREE + 1, *frames[0].shape), dtype=np.float32)
    for weight, frame in zip(weights.T, frames, strict=True):
        coefficients += weight[:, None, None] * frame
    return RampLight(coefficients, float(forces_n.min()), largest_n)


def _exponent(log_force: NDArray[np.float64], light: Image, frames: Sequence[Image], floor_counts: float) -> float:
    """Return d ln(light) / d ln(force) by least squares, held near `EXPONENT` as far as the frames do not tell."""
    seen = light >= floor_counts
    if not seen.any():
        return EXPONENT
    log_light = np.log([max(float(frame[seen].mean()), 1e-3) for frame in frames])
    x, y = log_force - log_force.mean(), log_light - log_light.mean()
    hold = (LIGHT_NOISE / EXPONENT_SPREAD) ** 2
    return float((x @ y + hold * EXPONENT) / (x @ x + hold))
