"""Faces under the loads of a protocol to what is seen of them: contrast on rings, its derivatives, its errors.

The contrast is light over that of the press without the lump, minus 1. What the camera adds is white: shot noise, read
noise and counting. What optics and models add is smooth over the face and stays, however many frames are taken.
Source of the camera's noise: EMVA Standard 1288; figures of `device/simulation/sensor.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from device.simulation.sensor import Sensor
from host_tools.forward.face_state import Rays
from host_tools.forward.mesh_velocity import OFFSET
from host_tools.forward.sensitive_ramp import LumpSensitivity
from host_tools.forward.sensitivity import FORCE, FaceSensitivity
from host_tools.inverse.pictures import IdealPicture, LightPicture, Picture, Profiles
from host_tools.inverse.protocol import Observable, Protocol
from host_tools.inverse.rings import Array, Rings

SENSOR = Sensor()
COUNTS = 255.0
"""Full scale; one count is a step of the camera, so its rounding has a variance of 1/12."""
WINDOW_RATIO = 0.9
"""The central window over the face."""
CONTACT_LAW, GAIN, FORCE_ERROR, PLACE = "contact_law", "gain", "force_error", "place"


@dataclass(frozen=True, eq=False)
class Sight:
    """One press as a sensor sees it, on K rings: M harmonics of the contrast, one after the other, and the light.

    `contrast` [M K] and its derivatives by the logarithm of each quantity; `by_force_error` by that of the press's
    force alone, its reference left as it is. `light` and `reference` [K]: ring means, with the lump and without it.
    """

    contrast: Array
    derivatives: Mapping[str, Array]
    by_force_error: Array
    light: Array
    reference: Array

    @property
    def harmonics(self) -> int:
        """How many harmonics of the angle are seen; 1 in axisymmetry."""
        return len(self.contrast) // len(self.light)

    @property
    def ratio(self) -> Array:
        """Light over reference [M K]: the contrast, and 1 more in the mean."""
        ratio = self.contrast.copy()
        ratio[: len(self.light)] += 1
        return ratio


@dataclass(frozen=True, eq=False)
class Observation:
    """N numbers: their values, derivatives [N] by the logarithm of each quantity, and covariance [N, N]."""

    values: Array
    derivatives: Mapping[str, Array]
    covariance: Array


def rings_of(presses: Sequence[LumpSensitivity]) -> Rings:
    """Return the rings that faces are seen on: those of the central window."""
    return Rings.within(WINDOW_RATIO * float(presses[0].rays.r_mm[0, -1]))


def sights(presses: Sequence[LumpSensitivity], observable: Observable) -> list[Sight]:
    """Return what a sensor sees of every press; the scalars are those of the image."""
    rings = rings_of(presses)
    return [_sight(press, _picture(press.rays, rings, observable), len(rings.r_mm)) for press in presses]


def _picture(rays: Rays, rings: Rings, observable: Observable) -> Picture:
    if observable in ("image", "scalars"):
        return LightPicture(rays, rings)
    return IdealPicture(rays, rings, observable)


def _sight(press: LumpSensitivity, picture: Picture, rings: int) -> Sight:
    """Return the contrast (light - reference) / mean reference; the reference has harmonics by its mesh only."""
    light, changes = _seen(press.pressed, picture)
    reference, reference_changes = _seen(press.bare, picture)
    repeated = len(light) // rings

    def of_mean(values: Array) -> Array:
        return np.tile(values[:rings], repeated)

    mean, unchanged = of_mean(reference), np.zeros_like(light)
    contrast = (light - reference) / mean
    derivatives = {}
    for name, change in changes.items():
        further = reference_changes.get(name, unchanged)
        derivatives[name] = (change - further - contrast * of_mean(further)) / mean
    return Sight(contrast, derivatives, changes[FORCE] / mean, light[:rings], reference[:rings])


def _seen(found: FaceSensitivity, picture: Picture) -> tuple[Array, dict[str, Array]]:
    """Return the light of a face and its derivatives by name."""
    face = Profiles(found.face.w_mm, found.face.p_kpa)
    changes = {name: picture.change(face, Profiles(rate.w_mm, rate.p_kpa)) for name, rate in found.rates.items()}
    return picture.light(face), changes | {CONTACT_LAW: picture.change_by_law(face)}


def observe(seen: Sequence[Sight], rings: Rings, protocol: Protocol) -> Observation:
    """Return all that is seen of all presses, one after the other, with the errors of a protocol."""
    values = np.concatenate([sight.contrast for sight in seen])
    derivatives = {name: np.concatenate([sight.derivatives[name] for sight in seen]) for name in seen[0].derivatives}
    derivatives[GAIN] = np.concatenate([sight.ratio for sight in seen])
    for i, sight in enumerate(seen):
        before, after = (sum(len(other.contrast) for other in part) for part in (seen[:i], seen[i + 1 :]))
        derivatives[f"{FORCE_ERROR}_{i}"] = np.pad(sight.by_force_error, (before, after))
        if OFFSET in sight.derivatives:
            derivatives[f"{PLACE}_{i}"] = np.pad(sight.derivatives[OFFSET], (before, after))
    white = np.diag(np.concatenate(_white_noise(seen, rings, protocol)))
    return Observation(values, derivatives, white + protocol.systematic_ratio**2 * _smooth(seen, rings, protocol))


def _white_noise(seen: Sequence[Sight], rings: Rings, protocol: Protocol) -> list[Array]:
    """Return the variance of the contrast of each ring and harmonic, for each press."""
    mean = float(np.average(seen[-1].reference, weights=rings.pixels))
    counts_per_light = protocol.mean_level_counts / mean
    frames, references = protocol.frames / len(seen), protocol.reference_frames / len(seen)
    variances = []
    for sight in seen:
        level, reference = sight.light * counts_per_light, sight.reference * counts_per_light
        per_pixel = variance_counts(level) / frames + (level / reference) ** 2 * variance_counts(reference) / references
        of_mean = per_pixel / reference**2 / rings.pixels
        variances.append(np.concatenate([of_mean, np.tile(2 * of_mean, sight.harmonics - 1)]))
    return variances


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
