"""Observed presses to numbers with derivatives and errors: contrasts, reference force response, the paper's scalars.

What the camera adds is white: shot noise, read noise and counting. What optics and models add is smooth over the face
and stays, however many frames are taken. Source of the camera's noise: EMVA Standard 1288; figures of
`device/simulation/physics/sensor.py`.

The reference force response is the logarithm of the reference over that at the largest load, ring by ring: the pattern
of LEDs and lens drops out, and what is left knows of tissue and skin. Its noise is that which the contrasts have of the
same reference frames. The probe reads it too (`device/measurement/ramp_modes/radial_profile.py`).

The paper's three scalars are taken as the probe takes them (`device/measurement/paper_mode/features.py`): smoothed
contrast at the centre, its integral over the window, and the area where it exceeds half of the first. Derivatives and
errors are carried along to first order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from device.simulation.physics.sensor import Sensor
from host_tools.cramer_rao.observed_press import ObservedPress
from host_tools.cramer_rao.protocol import PressProtocol
from host_tools.cramer_rao.rings import Rings
from host_tools.forward.derivatives.mesh_velocity import OFFSET

SENSOR = Sensor()
COUNTS = 255.0
"""Full scale; one count is a step of the camera, so its rounding has a variance of 1/12."""
GAIN, ZERO, FORCE_ERROR, PLACE = "gain", "zero_n", "force_error", "place"
SMOOTHING_MM = 0.5
THRESHOLD_RATIO = 0.5
STEP = 1e-6
"""Of the contrast, in differences of the scalars."""


@dataclass(frozen=True, eq=False)
class Observation:
    """N numbers: their values, derivatives [N] by each quantity or its logarithm, and covariance [N, N]."""

    values: Array
    derivatives: Mapping[str, Array]
    covariance: Array


def observe(seen: Sequence[ObservedPress], rings: Rings, protocol: PressProtocol) -> Observation:
    """Return the contrasts of all presses, one after the other, with the errors of a protocol."""
    values = np.concatenate([press.contrast for press in seen])
    derivatives = {name: np.concatenate([press.derivatives[name] for press in seen]) for name in seen[0].derivatives}
    derivatives[GAIN] = np.concatenate([press.ratio for press in seen])
    derivatives[ZERO] = np.concatenate([press.by_force_error / press.force_n for press in seen])
    for i, press in enumerate(seen):
        before, after = (sum(len(other.contrast) for other in part) for part in (seen[:i], seen[i + 1 :]))
        derivatives[f"{FORCE_ERROR}_{i}"] = np.pad(press.by_force_error, (before, after))
        if OFFSET in press.derivatives:
            derivatives[f"{PLACE}_{i}"] = np.pad(press.derivatives[OFFSET], (before, after))
    white = np.diag(np.concatenate(_white_noise(seen, rings, protocol)))
    return Observation(values, derivatives, white + protocol.systematic_ratio**2 * _smooth(seen, rings, protocol))


def _white_noise(seen: Sequence[ObservedPress], rings: Rings, protocol: PressProtocol) -> list[Array]:
    """Return the variance of the contrast of each ring and harmonic, for each press."""
    lights = _noise_of_light([press.light for press in seen], seen, rings, protocol, protocol.frames)
    references = noise_of_reference(seen, rings, protocol)
    variances = []
    for press, light, reference in zip(seen, lights, references, strict=True):
        of_mean = (press.light / press.reference) ** 2 * (light + reference)
        variances.append(np.concatenate([of_mean, np.tile(2 * of_mean, press.harmonics - 1)]))
    return variances


def noise_of_reference(seen: Sequence[ObservedPress], rings: Rings, protocol: PressProtocol) -> list[Array]:
    """Return the variance [K] of the logarithm of the reference on each ring, for each press."""
    return _noise_of_light([press.reference for press in seen], seen, rings, protocol, protocol.reference_frames)


def _noise_of_light(
    lights: Sequence[Array], seen: Sequence[ObservedPress], rings: Rings, protocol: PressProtocol, frames: int
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


def _smooth(seen: Sequence[ObservedPress], rings: Rings, protocol: PressProtocol) -> Array:
    """Return the covariance of smooth errors of ratio 1: those of the light, alike in all presses, and each one's own.

    Different harmonics do not couple.
    """
    parts = [(i, m, press.ratio[: len(rings.r_mm)]) for i, press in enumerate(seen) for m in range(press.harmonics)]
    zero = np.zeros((len(rings.r_mm), len(rings.r_mm)))

    def block(i: int, m: int, light: Array, j: int, n: int, other: Array) -> Array:
        if m != n:
            return zero
        common = rings.coupling(protocol.common_correlation_mm, m) * np.outer(light, other)
        return common + rings.coupling(protocol.load_correlation_mm, m) if i == j else common

    return np.block([[block(*row, *column) for column in parts] for row in parts])


def with_reference_response(
    observed: Observation, seen: Sequence[ObservedPress], rings: Rings, protocol: PressProtocol
) -> Observation:
    """Return the observation with the reference force response: (P - 1) K more numbers for P loads on the axis."""
    ramp, count = seen[: len(protocol.forces_n)], len(rings.r_mm)
    rise = _rise(len(ramp), count)
    unchanged = np.zeros(len(ramp) * count)
    by_reference = {
        name: np.concatenate([s.reference_derivatives[name] for s in ramp]) for name in ramp[0].reference_derivatives
    }
    derivatives = {
        name: np.concatenate([change, rise @ by_reference.get(name, unchanged)])
        for name, change in observed.derivatives.items()
    }
    white = np.concatenate(noise_of_reference(seen, rings, protocol)[: len(ramp)])
    smooth = np.kron(np.eye(len(ramp)), rings.coupling(protocol.load_correlation_mm))
    own = rise @ (np.diag(white) + protocol.systematic_ratio**2 * smooth) @ rise.T
    shared = np.zeros((len(observed.values), len(rise)))
    ratio = np.concatenate([s.light / s.reference for s in ramp])
    shared[: len(ratio)] = -np.diag(ratio * white) @ rise.T  # a brighter reference is less contrast
    return Observation(
        np.concatenate([observed.values, rise @ np.log(np.concatenate([s.reference for s in ramp]))]),
        derivatives,
        np.block([[observed.covariance, shared], [shared.T, own]]),
    )


def _rise(loads: int, rings: int) -> Array:
    """Return the matrix [(P - 1) K, P K] that takes the last load's logarithms from those of all others."""
    from_last = np.hstack([np.eye(loads - 1), -np.ones((loads - 1, 1))])
    return np.asarray(np.kron(from_last, np.eye(rings)), dtype=np.float64)


def scalars_of(seen: Observation, loads: int, rings: Rings) -> Observation:
    """Return centre (1), integral (mm2) and bright area (mm2) for each load instead of the rings.

    An area that fills the window is left out: it has no error, and knows nothing.
    """
    slope = _slope(seen.values, loads, rings)
    varies = slope.any(axis=1)
    slope = slope[varies]
    return Observation(
        _scalars(seen.values, loads, rings)[varies],
        {name: slope @ change for name, change in seen.derivatives.items()},
        slope @ seen.covariance @ slope.T,
    )


def _slope(contrast: Array, loads: int, rings: Rings) -> Array:
    """Return the derivatives [scalars, rings] of all scalars by the contrast of every ring."""
    steps = STEP * np.eye(len(contrast))
    columns = [_scalars(contrast + s, loads, rings) - _scalars(contrast - s, loads, rings) for s in steps]
    return np.stack(columns, axis=1) / (2 * STEP)


def _scalars(contrast: Array, loads: int, rings: Rings) -> Array:
    return np.concatenate([three_scalars(part, rings) for part in np.split(contrast, loads)])


def three_scalars(contrast: Array, rings: Rings) -> Array:
    """Return centre, integral and bright area of the contrast on rings [K].

    The area ends where the straight line between two rings first falls below the threshold; without such a place it
    is the whole window's, and tells nothing.
    """
    weight = rings.area_mm2 * np.exp(-(rings.r_mm**2) / (2 * SMOOTHING_MM**2))
    centre = float(weight @ contrast / weight.sum())
    above = (contrast - THRESHOLD_RATIO * centre) * np.sign(centre)
    below = np.flatnonzero(above[1:] <= 0)
    if not len(below):
        return np.array([centre, rings.area_mm2 @ contrast, rings.area_mm2.sum()])
    i = int(below[0])
    edge_mm = rings.r_mm[i] + (rings.r_mm[i + 1] - rings.r_mm[i]) * above[i] / (above[i] - above[i + 1])
    return np.array([centre, rings.area_mm2 @ contrast, np.pi * edge_mm**2])
