"""A press profile to the named numbers of the bright spot's shape, at each force of the ramp and of the whole press.

They describe the ring profile, not the image: a ring blurs along the radius, so a Gaussian of standard deviation s
reads as one of sqrt(s^2 + `RING_MM`^2 / 6), 1 % wider at 3 mm. Where there is no inclusion there is no shape: NaN.
Source: docs/features.md (definitions and measured sensitivities); the words are in `feature_definitions`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.paper_mode.feature_definitions import PRESS_FEATURES, RAMP_FEATURES
from device.measurement.radial_gaussian import NO_GAUSSIAN, fit_gaussian
from device.measurement.ramp_modes.radial_profile import PressProfile
from device.measurement.recording.ring_means import RING_AREAS_MM2, RING_MM, RING_RADII_MM, RINGS

NOISE_MULTIPLE = 3.0
"""A peak up to this many times the profile's residual is noise, not an inclusion."""
FINE_MM: Array = np.linspace(0.0, RING_RADII_MM[-1], 901)
INNER = slice(1, -1)
"""Rings whose harmonics count: the middle has none, and the frame's edges cut the last."""


@dataclass(frozen=True, eq=False)
class ShapeFeatures:
    """Arrays [K] at the forces `force_n`, and numbers of the press; units in the names, words in `feature_definitions`.

    `peak_contrast` and `total_contrast_mm2` are always numbers. The others are NaN without an inclusion, that is at a
    force where the peak is within `NOISE_MULTIPLE` of the noise, and where they are not defined: a width beyond the
    window.
    """

    force_n: Array
    peak_contrast: Array
    full_width_half_maximum_mm: Array
    total_contrast_mm2: Array
    mean_radius_mm: Array
    rms_radius_mm: Array
    gaussian_peak: Array
    gaussian_sigma_mm: Array
    gaussian_residual_ratio: Array
    centroid_offset_mm: Array
    ellipticity: Array
    mean_centroid_offset_mm: float
    mean_ellipticity: float
    peak_change_per_n: float
    total_change_per_n: float
    width_change_mm_per_n: float

    def as_dict(self) -> dict[str, float]:
        """Return every number by name; those of a force end in it, as in `peak_contrast_0.40_n`."""
        at_forces = {
            f"{name}_{force:.2f}_n": float(value)
            for name in RAMP_FEATURES
            for force, value in zip(self.force_n, getattr(self, name), strict=True)
        }
        return at_forces | {name: getattr(self, name) for name in PRESS_FEATURES}


def shape_features(profile: PressProfile) -> ShapeFeatures:
    """Return the features of a press profile."""
    noise = NOISE_MULTIPLE * profile.residual
    fine = profile.contrast @ _FINE.T
    peak, total = fine.max(axis=1), profile.contrast @ RING_AREAS_MM2
    inclusion = peak > noise
    width = np.where(inclusion, [_full_width_mm(row) for row in fine], np.nan)
    mean_radius, rms_radius = np.where(inclusion, _moments_mm(profile.contrast), np.nan)
    gaussian = np.array(
        [fit_gaussian(row) if seen else NO_GAUSSIAN for row, seen in zip(profile.contrast, inclusion, strict=True)]
    )
    offset, ellipticity = _asymmetry(profile, inclusion)
    mean_offset, mean_ellipticity = _mean_asymmetry(profile) if inclusion.all() else (np.nan, np.nan)
    slope = [_slope_per_n(profile.force_n, values) if inclusion.all() else np.nan for values in (peak, total, width)]
    return ShapeFeatures(
        force_n=profile.force_n,
        peak_contrast=peak,
        full_width_half_maximum_mm=width,
        total_contrast_mm2=total,
        mean_radius_mm=mean_radius,
        rms_radius_mm=rms_radius,
        gaussian_peak=gaussian[:, 0],
        gaussian_sigma_mm=gaussian[:, 1],
        gaussian_residual_ratio=gaussian[:, 3],
        centroid_offset_mm=offset,
        ellipticity=ellipticity,
        mean_centroid_offset_mm=mean_offset,
        mean_ellipticity=mean_ellipticity,
        peak_change_per_n=slope[0] / float(peak.mean()) if inclusion.all() else np.nan,
        total_change_per_n=slope[1] / float(total.mean()) if inclusion.all() else np.nan,
        width_change_mm_per_n=slope[2],
    )


def _full_width_mm(fine: Array) -> float:
    """Return twice the radius, beyond the peak, at which a profile on `FINE_MM` falls to half of it."""
    top = int(fine.argmax())
    half = fine[top] / 2
    below = np.flatnonzero(fine[top:] < half)
    if not len(below):
        return float("nan")
    last = top + int(below[0]) - 1
    beyond = (fine[last] - half) / (fine[last] - fine[last + 1])
    return float(2 * (FINE_MM[last] + beyond * (FINE_MM[1] - FINE_MM[0])))


def _moments_mm(contrast: Array) -> Array:
    """Return mean and root mean square radius [2, K] of the positive contrast; NaN where there is none."""
    weight = np.maximum(contrast, 0.0) * RING_AREAS_MM2
    total = np.where(weight.any(axis=1), weight.sum(axis=1), np.nan)
    return np.array([weight @ RING_RADII_MM / total, np.sqrt(weight @ RING_RADII_MM**2 / total)])


def _asymmetry(profile: PressProfile, inclusion: NDArray[np.bool_]) -> Array:
    """Return offset (mm) and ellipticity [2, K] of the profile at each force; NaN where there is no inclusion [K]."""
    rows = zip(profile.contrast, profile.offset_at_force, profile.elongation_at_force, strict=True)
    return np.array(
        [_shift_and_stretch(*row) if seen else (np.nan, np.nan) for row, seen in zip(rows, inclusion, strict=True)]
    ).T


def _mean_asymmetry(profile: PressProfile) -> tuple[float, float]:
    """Return offset (mm) and ellipticity of the ramp's mean profile, whose harmonics the means over the ramp are."""
    return _shift_and_stretch(profile.contrast.mean(axis=0), profile.offset, profile.elongation)


def _shift_and_stretch(contrast: Array, first: Array, second: Array) -> tuple[float, float]:
    """Return shift s (mm) and ellipticity e of a profile [J] from its harmonics [J - 1].

    A small shift adds -s dC/dr cos(angle), an ellipse -e r dC/dr cos(2 angle). Rings count by their area.
    """
    r, slope = RING_RADII_MM[INNER], (_SLOPES @ contrast)[INNER]
    return tuple(
        float(-(r * shape) @ harmonic[:-1] / ((r * shape) @ shape))
        for shape, harmonic in ((slope, first), (r * slope, second))
    )  # type: ignore[return-value]


def _slope_per_n(force_n: Array, values: Array) -> float:
    """Return the slope of the straight line through values over the force."""
    centred = force_n - force_n.mean()
    return float(centred @ values / (centred @ centred))


def _slope_matrix() -> Array:
    """Return the matrix [J, J] from a profile to its cubic spline's slopes (1/mm): flat in the middle, natural outside.

    Source: de Boor, A Practical Guide to Splines (2001), chapter IV.
    """
    system, right = np.eye(RINGS), np.zeros((RINGS, RINGS))
    for j in range(1, RINGS - 1):
        system[j, j - 1 : j + 2] = 1, 4, 1
        right[j, j - 1], right[j, j + 1] = -3, 3
    system[-1, -2:], right[-1, -2:] = (1, 2), (-3, 3)
    return np.asarray(np.linalg.solve(system, right / RING_MM))


def _fine_matrix() -> Array:
    """Return the matrix [n, J] from a profile to its cubic spline at `FINE_MM`."""
    place = np.minimum(FINE_MM / RING_MM, RINGS - 1 - 1e-9)
    j, t = place.astype(int), (place % 1)[:, None]
    one = np.eye(RINGS)
    values = (1 + 2 * t) * (1 - t) ** 2 * one[j] + t**2 * (3 - 2 * t) * one[j + 1]
    slopes = t * (1 - t) ** 2 * _SLOPES[j] + t**2 * (t - 1) * _SLOPES[j + 1]
    return np.asarray(values + RING_MM * slopes)


_SLOPES = _slope_matrix()
_FINE = _fine_matrix()
