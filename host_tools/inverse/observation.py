"""Sights of all presses to numbers with their derivatives and errors: the contrasts, one press after the other.

What the camera adds is white: shot noise, read noise and counting. What optics and models add is smooth over the face
and stays, however many frames are taken.
Source of the camera's noise: EMVA Standard 1288; figures of `device/simulation/sensor.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from device.simulation.sensor import Sensor
from host_tools.forward.mesh_velocity import OFFSET
from host_tools.inverse.protocol import Protocol
from host_tools.inverse.rings import Array, Rings
from host_tools.inverse.sight import Sight

SENSOR = Sensor()
COUNTS = 255.0
"""Full scale; one count is a step of the camera, so its rounding has a variance of 1/12."""
GAIN, ZERO, FORCE_ERROR, PLACE = "gain", "zero_n", "force_error", "place"


@dataclass(frozen=True, eq=False)
class Observation:
    """N numbers: their values, derivatives [N] by each quantity or its logarithm, and covariance [N, N]."""

    values: Array
    derivatives: Mapping[str, Array]
    covariance: Array


def observe(seen: Sequence[Sight], rings: Rings, protocol: Protocol) -> Observation:
    """Return the contrasts of all presses, one after the other, with the errors of a protocol."""
    values = np.concatenate([sight.contrast for sight in seen])
    derivatives = {name: np.concatenate([sight.derivatives[name] for sight in seen]) for name in seen[0].derivatives}
    derivatives[GAIN] = np.concatenate([sight.ratio for sight in seen])
    derivatives[ZERO] = np.concatenate([sight.by_force_error / sight.force_n for sight in seen])
    for i, sight in enumerate(seen):
        before, after = (sum(len(other.contrast) for other in part) for part in (seen[:i], seen[i + 1 :]))
        derivatives[f"{FORCE_ERROR}_{i}"] = np.pad(sight.by_force_error, (before, after))
        if OFFSET in sight.derivatives:
            derivatives[f"{PLACE}_{i}"] = np.pad(sight.derivatives[OFFSET], (before, after))
    white = np.diag(np.concatenate(_white_noise(seen, rings, protocol)))
    return Observation(values, derivatives, white + protocol.systematic_ratio**2 * _smooth(seen, rings, protocol))


def _white_noise(seen: Sequence[Sight], rings: Rings, protocol: Protocol) -> list[Array]:
    """Return the variance of the contrast of each ring and harmonic, for each press."""
    lights = _noise_of_light([sight.light for sight in seen], seen, rings, protocol, protocol.frames)
    references = noise_of_reference(seen, rings, protocol)
    variances = []
    for sight, light, reference in zip(seen, lights, references, strict=True):
        of_mean = (sight.light / sight.reference) ** 2 * (light + reference)
        variances.append(np.concatenate([of_mean, np.tile(2 * of_mean, sight.harmonics - 1)]))
    return variances


def noise_of_reference(seen: Sequence[Sight], rings: Rings, protocol: Protocol) -> list[Array]:
    """Return the variance [K] of the logarithm of the reference on each ring, for each press."""
    return _noise_of_light([sight.reference for sight in seen], seen, rings, protocol, protocol.reference_frames)


def _noise_of_light(
    lights: Sequence[Array], seen: Sequence[Sight], rings: Rings, protocol: Protocol, frames: int
) -> list[Array]:
    """Return the variance [K] of the logarithm of a light on each ring, for each press."""
    counts_per_light = protocol.mean_level_counts / float(np.average(seen[-1].reference, weights=rings.pixels))
    seen_by = frames / len(seen) * rings.pixels
    return [variance_counts(light * counts_per_light) / (light * counts_per_light) ** 2 / seen_by for light in lights]


def variance_counts(level_counts: Array) -> Array:
    """Return the variance (counts squared) of one pixel of one frame at a level (counts of 8 bits)."""
    electrons_per_count = SENSOR.full_well_e / COUNTS
    electrons = np.maximum(level_counts, 0.0) * electrons_per_count
    return np.asarray((electrons + SENSOR.read_noise_e**2) / electrons_per_count**2 + 1 / 12)


def _smooth(seen: Sequence[Sight], rings: Rings, protocol: Protocol) -> Array:
    """Return the covariance of smooth errors of ratio 1: those of the light, alike in all presses, and each one's own.

    Different harmonics do not couple.
    """
    parts = [(i, m, sight.ratio[: len(rings.r_mm)]) for i, sight in enumerate(seen) for m in range(sight.harmonics)]
    zero = np.zeros((len(rings.r_mm), len(rings.r_mm)))

    def block(i: int, m: int, light: Array, j: int, n: int, other: Array) -> Array:
        if m != n:
            return zero
        common = rings.coupling(protocol.common_correlation_mm, m) * np.outer(light, other)
        return common + rings.coupling(protocol.load_correlation_mm, m) if i == j else common

    return np.block([[block(*row, *column) for column in parts] for row in parts])
