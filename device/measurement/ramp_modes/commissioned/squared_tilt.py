"""What tilts do to a ratio of two lights that lean, the lesion's over the reference's, beyond first order.

Along a radius e it is (1 + p e) / (1 + b e), of tilts p and b in units of a hand's habit: to second order it has
(b e) (b e - p e) beside p e - b e. Of both only d = p - b is seen, in the first harmonic. Given that, b lies about
-d / 2, as far off in each direction as 1 / sqrt(2) of a habit: so (d e)^2 / 2 is told, and (D e) (d e) is not.
Such products move ring means and second harmonics, in stiff tissue by a hundredth of the light: there the pressure
falls off steeply across a face that leans. What higher orders do grows with the cube of the first harmonic.

Habits are the same on the lesion and beside it. Presses of a scan are taken each by itself, though they share b.
"""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array
from device.measurement.ramp_modes.radial_profile import CONTRAST, SECOND, SECOND_ACROSS, SEEN_COLUMNS
from device.measurement.recording.ring_means import RING_RADII_MM

FURTHER_RATIO, ALIKE_MM = 0.25, 1.35
"""Of the cube of the larger tilt's first harmonic, root mean square, where that is 0.15 to 0.5; over so many
millimetres it is alike. Of random tilts of the virtual probe in people's tissue
(`tests/host_tools/press_models/test_press_derivatives.py`)."""
HABITS_LARGER = 90 ** (1 / 3)
"""E[m^6]^(1/3) of the larger m of |p| and |b|, whose squares are exponential of mean 2 each: 2 * 48 - 6 is E[m^6]."""
LEFT_STD = 0.5**0.5
"""Standard deviation of D in each direction."""
BELIEVED_STD = 1.5**0.5
"""That of the whole product in each of its parts, where nothing is seen yet; its mean is 1 in ring means."""


def of_leaning(squares: Array, leant: Array) -> tuple[Array, Array]:
    """Return what moves presses that leant by d [N, 2] along the bright side and across it [N, S].

    And a factor [N, S, K] of the covariance of what is not told. `squares` [N, K, J] are those of the first
    harmonic of a habit's tilt.
    """
    told = 0.5 * _products(squares, leant, leant)
    unknown = [LEFT_STD * _products(squares, np.broadcast_to(axis, leant.shape), leant) for axis in np.eye(2)]
    unknown.append(np.zeros_like(told))  # as many columns as of a habit: what is drawn by the one is told by the other
    further = _higher_orders(squares, _larger_given(np.linalg.norm(leant, axis=1)))
    return told, np.concatenate([np.stack(unknown, axis=2), further], axis=2)


def of_habit(squares: Array) -> tuple[Array, Array]:
    """Return the same of presses of which nothing is seen yet."""
    shift, factor = np.zeros((len(squares), SEEN_COLUMNS)), np.zeros((len(squares), SEEN_COLUMNS, 3))
    shift[:, CONTRAST] = squares.reshape(len(squares), -1)
    factor[:, CONTRAST, 0] = BELIEVED_STD * shift[:, CONTRAST]
    factor[:, SECOND, 1] = factor[:, SECOND_ACROSS, 2] = BELIEVED_STD * _seconds(squares)
    further = _higher_orders(squares, np.full(len(squares), HABITS_LARGER))
    return shift, np.concatenate([factor, further], axis=2)


def _larger_given(leant: Array) -> Array:
    """Return E[m^6]^(1/3) of the larger m of |p| and |b| given |d| [N], within 2 % of random tilts up to |d| = 6.

    Where nothing is left of d, |p|^2 is exponential of mean 1, and E[m^6] is 6.
    """
    return np.asarray(6 ** (1 / 3) + 0.65 * leant + 0.23 * leant**2)


def _higher_orders(squares: Array, larger_square: Array) -> Array:
    """Return a factor [N, S, K] of what higher orders do where the larger tilt's square is that [N].

    It is smooth along the rings.
    """
    count, _, rings = squares.shape
    larger = np.sqrt(squares * larger_square[:, None, None])
    bent = FURTHER_RATIO * larger[..., 1:, None] ** 3 * SMOOTH_FACTOR
    factor = np.zeros((count, SEEN_COLUMNS, 3 * (rings - 1)))
    means = np.zeros((*squares.shape, rings - 1))
    means[:, :, 1:] = bent
    each = np.split(factor, 3, axis=2)
    each[0][:, CONTRAST] = means.reshape(count, -1, rings - 1)
    for one, part in ((each[1], SECOND), (each[2], SECOND_ACROSS)):
        one[:, part] = bent[:, :, :-1].reshape(count, -1, rings - 1)
    return factor


def _smooth_factor() -> Array:
    """Return a factor [J - 1, J - 1] of the correlation of rings."""
    r_mm = RING_RADII_MM[1:]
    apart = (r_mm[:, None] - r_mm) / ALIKE_MM
    return np.asarray(np.linalg.cholesky(np.exp(-(apart**2) / 2) + 1e-9 * np.eye(len(r_mm))))


SMOOTH_FACTOR = _smooth_factor()


def _products(squares: Array, one: Array, other: Array) -> Array:
    """Return the mean over the angle and second harmonics of (one e) (other e) [N, S]."""
    (x, y), (u, v) = one.T[:, :, None], other.T[:, :, None]
    found = np.zeros((len(squares), SEEN_COLUMNS))
    found[:, CONTRAST] = (x * u + y * v) / 2 * squares.reshape(len(squares), -1)
    found[:, SECOND] = (x * u - y * v) / 2 * _seconds(squares)
    found[:, SECOND_ACROSS] = (x * v + y * u) / 2 * _seconds(squares)
    return found


def _seconds(squares: Array) -> Array:
    """Return the squares at the rings of second harmonics [N, K (J - 2)]."""
    return np.asarray(squares[:, :, 1:-1].reshape(len(squares), -1))
