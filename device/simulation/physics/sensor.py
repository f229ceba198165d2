"""Light to counts: electrons, shot and read noise, fixed pattern, full well, gain, black level, 8, 10 or 12 bits.

Deterministic: one seed makes the sensor's fixed pattern, another (scenario and frame number) a frame's noise.
An 8-bit frame has no noise where it is dark enough; the black level keeps that from biasing the mean of dark frames.
Source: EMVA Standard 1288 (linear camera model); figures: 10 000 e- full well and 4 e- read noise of an OV9281-class
mono sensor, the fixed pattern assumed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.tactile_image import Counts, Image

ACTION = "use a real camera's data sheet"
POOL = 2**22
"""Places in a scenario's pool of noise where a frame's may begin."""
NOT_NEGATIVE = {
    "read_noise_e": "e-",
    "dark_e_per_s": "e-/s",
    "offset_spread_e": "e-",
    "hot_pixel_e_per_s": "e-/s",
    "ambient_intensity": "",
}


@dataclass(frozen=True)
class Sensor:
    """A mono camera; `sensitivity_e_per_us` electrons a microsecond at intensity 1.

    `gain_spread_ratio` (PRNU) and `offset_spread_e` (DSNU) are standard deviations over pixels, `hot_pixel_ratio` the
    share of pixels with a dark current of some `hot_pixel_e_per_s`; `ambient_intensity` is light that is there
    whatever the LEDs do. `black_level_counts` is in counts of 8 bits.
    """

    sensitivity_e_per_us: float = 5.0
    full_well_e: float = 10_000.0
    read_noise_e: float = 4.0
    black_level_counts: float = 4.0
    bits: int = 8
    gain_spread_ratio: float = 0.01
    offset_spread_e: float = 1.0
    dark_e_per_s: float = 50.0
    hot_pixel_ratio: float = 2e-5
    hot_pixel_e_per_s: float = 1e6
    ambient_intensity: float = 0.0
    pattern_seed: int = 7

    def __post_init__(self) -> None:
        for name in ("sensitivity_e_per_us", "full_well_e"):
            require(f"sensor.{name}", getattr(self, name), Bound(0.0, 1e6, "e-", low_included=False), ACTION)
        for name, unit in NOT_NEGATIVE.items():
            require(f"sensor.{name}", getattr(self, name), Bound(0.0, 1e9, unit), ACTION)
        for name, high in (("gain_spread_ratio", 0.2), ("hot_pixel_ratio", 0.5)):
            require(f"sensor.{name}", getattr(self, name), Bound(0.0, high, ""), ACTION)
        require("sensor.black_level_counts", self.black_level_counts, Bound(0.0, 100.0, "counts"), ACTION)
        require("sensor.pattern_seed", self.pattern_seed, Bound(0, 2**63, ""), "give a whole number from 0")
        if self.bits not in (8, 10, 12):
            raise InvalidQuantity("sensor.bits", self.bits, "8, 10 or 12", ACTION)

    @property
    def full_scale(self) -> int:
        """Largest count of its own bits."""
        return int(2**self.bits - 1)

    def expose(self, intensity: Image, *, exposure_us: float, gain: float, seed: tuple[int, int]) -> Counts:
        """Return the counts of one exposure; the seed is (scenario, frame number).

        uint8, or for 10 bits uint16 with the 10 at the top, as frames of 16 bits have them.
        """
        pattern = _pattern(self, intensity.shape)
        electrons = np.maximum(intensity, 0)
        electrons += np.float32(self.ambient_intensity)
        electrons *= pattern.gain * np.float32(self.sensitivity_e_per_us * exposure_us)
        electrons += pattern.dark_e_per_s * np.float32(1e-6 * exposure_us)
        # Gaussian instead of Poisson shot noise: indistinguishable above some 20 electrons, and three times as fast.
        deviation = np.sqrt(electrons + np.float32(self.read_noise_e**2))
        electrons += deviation * _noise(seed, electrons.size).reshape(electrons.shape)
        np.minimum(electrons, np.float32(self.full_well_e), out=electrons)
        electrons += pattern.offset_e
        electrons *= np.float32(gain * self.full_scale / self.full_well_e)
        electrons += np.float32(self.black_level_counts * self.full_scale / 255)
        np.rint(electrons, out=electrons)
        np.clip(electrons, 0, self.full_scale, out=electrons)
        if self.bits == 8:
            return electrons.astype(np.uint8)
        return electrons.astype(np.uint16) * np.uint16(2 ** (16 - self.bits))


class Pattern(NamedTuple):
    """What differs from pixel to pixel and never changes [height, width]."""

    gain: NDArray[np.float32]
    offset_e: NDArray[np.float32]
    dark_e_per_s: NDArray[np.float32]


def _noise(seed: tuple[int, int], size: int) -> NDArray[np.float32]:
    """Return normal numbers for one frame: a stretch of the scenario's pool, begun at a place of its own.

    Drawing a frame's numbers anew would take longer than all else that makes the frame.
    """
    pool = _pool(seed[0], POOL + size)
    start = int(np.random.SeedSequence(seed).generate_state(1)[0] % POOL)
    return pool[start : start + size]


@lru_cache(maxsize=2)
def _pool(seed: int, size: int) -> NDArray[np.float32]:
    rng = np.random.Generator(np.random.SFC64(np.random.SeedSequence(seed)))
    return rng.standard_normal(size, dtype=np.float32)


@lru_cache(maxsize=4)
def _pattern(sensor: Sensor, shape: tuple[int, int]) -> Pattern:
    rng = np.random.default_rng(sensor.pattern_seed)
    gain = 1 + sensor.gain_spread_ratio * rng.standard_normal(shape, dtype=np.float32)
    offset_e = sensor.offset_spread_e * rng.standard_normal(shape, dtype=np.float32)
    hot = rng.random(shape, dtype=np.float32) < sensor.hot_pixel_ratio
    dark_e_per_s = sensor.dark_e_per_s + hot * sensor.hot_pixel_e_per_s * rng.exponential(size=shape)
    return Pattern(np.maximum(gain, 0), np.asarray(offset_e, np.float32), np.asarray(dark_e_per_s, np.float32))
