"""Light to counts: electrons, shot and read noise, full well, gain, quantisation. Deterministic for a seed and frame.

An 8-bit frame has no noise where it is dark enough; the black level keeps that from biasing the mean of dark frames.
Source: EMVA Standard 1288 (linear camera model); figures: 10 000 e- full well and 4 e- read noise of an OV9281-class
mono sensor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, require
from device.measurement.tactile_image import Image

ACTION = "use a real camera's data sheet"


@dataclass(frozen=True)
class Sensor:
    """An 8-bit mono camera; `sensitivity_e_per_us` electrons a microsecond at intensity 1."""

    sensitivity_e_per_us: float = 5.0
    full_well_e: float = 10_000.0
    read_noise_e: float = 4.0
    black_level_counts: float = 4.0

    def __post_init__(self) -> None:
        for name in ("sensitivity_e_per_us", "full_well_e"):
            require(f"sensor.{name}", getattr(self, name), Bound(0.0, 1e6, "e-", low_included=False), ACTION)
        require("sensor.read_noise_e", self.read_noise_e, Bound(0.0, 1e4, "e-"), ACTION)
        require("sensor.black_level_counts", self.black_level_counts, Bound(0.0, 100.0, "counts"), ACTION)

    def expose(self, intensity: Image, *, exposure_us: float, gain: float, seed: tuple[int, int]) -> NDArray[np.uint8]:
        """Return the counts of one exposure; the seed is (scenario, frame number)."""
        rng = np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed)))
        electrons = np.maximum(intensity, 0) * np.float32(self.sensitivity_e_per_us * exposure_us)
        noise = rng.standard_normal(electrons.shape, dtype=np.float32)
        # Gaussian instead of Poisson shot noise: indistinguishable above some 20 electrons, and three times as fast.
        electrons += noise * np.sqrt(electrons + np.float32(self.read_noise_e**2))
        np.minimum(electrons, np.float32(self.full_well_e), out=electrons)
        counts = electrons * np.float32(gain * 255 / self.full_well_e) + np.float32(self.black_level_counts)
        return np.asarray(np.clip(np.rint(counts), 0, 255).astype(np.uint8))
