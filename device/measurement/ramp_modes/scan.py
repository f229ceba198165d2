"""Where the presses of a scan lie, and where a further one would tell most.

A press displaced by some millimetres sees the inclusion's pattern moved and the errors of face and flat field not: it
tells both apart, which presses at one place cannot. Nobody measures where the hand puts the probe: each press's offset
is an unknown. What a further press is worth is the Gaussian bound of the joint posterior at the best fit.
Sources: Kay, Fundamentals of Statistical Signal Processing I (1993), 3.7 (bound); Lindley, Ann. Math. Stat. 27 (1956)
(expected information of an experiment).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import COUNT, EVEN_STD, HIGH
from device.measurement.ramp_modes.fit import Explained, PressPosterior
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.surrogate import OFFSET, PressRows

OFFSETS_TRIED_MM = np.array([0.3, 1.5, 3.0, 4.5, 6.0, 7.5])
"""The best fit is sought from the offset of these that explains a press best."""


def scan_starts(
    rows: Array,
    estimates: Array,
    surrogate: PressRows,
    noise: PressNoise,
    reach_mm: float,
    direction_rad: Array | None = None,
) -> Array:
    """Return coordinates [n, 8 + N] from which to seek the best fit of presses, rows [N, P], directions [N].

    One for each of the first guesses of the unknowns, `estimates` [n, 3], nuisances in the middle of their ranges.
    """
    directions = [None] * len(rows) if direction_rad is None else [np.array([one]) for one in direction_rad]
    presses = [
        PressPosterior(row, surrogate, noise, reach_mm, direction)
        for row, direction in zip(rows, directions, strict=True)
    ]
    tried = 2 * OFFSETS_TRIED_MM / reach_mm - 1
    starts = np.zeros((len(estimates), OFFSET + len(rows)))
    starts[:, :COUNT] = estimates
    points = np.column_stack([np.repeat(starts[:, :OFFSET], len(tried), axis=0), np.tile(tried, len(starts))])
    for number, press in enumerate(presses, start=OFFSET):
        left = np.sum(press.residuals(points) ** 2, axis=1)
        starts[:, number] = tried[np.argmin(left.reshape(-1, len(tried)), axis=1)]
    return starts


def worth_of_places(
    rows: Array,
    best: Array,
    surrogate: PressRows,
    noise: PressNoise,
    reach_mm: float,
    places_mm: Sequence[float],
    direction_rad: Array | None = None,
) -> Array:
    """Return to which part [n, 3] a further press at each place narrows the unknowns' spreads, bound over bound.

    `rows` [N, P] and directions [N] are those of the presses so far, `best` [8 + N] their best fit. The direction of
    the further one is the hand's choice.
    """
    posterior = PressPosterior(rows, surrogate, noise, reach_mm, direction_rad)
    before = bound_of(posterior, best)
    parts = []
    for place_mm in places_mm:
        further = np.append(best[:OFFSET], 2 * place_mm / float(HIGH[OFFSET]) - 1)
        after = posterior.with_further(surrogate.rows(further[None])[0])
        parts.append(bound_of(after, np.append(best, 2 * place_mm / reach_mm - 1)) / before)
    return np.array(parts)


def bound_of(posterior: Explained, at: Array) -> Array:
    """Return the unknowns' spreads [3] of the Gaussian posterior at coordinates [8 + N]."""
    _, (jacobian,) = posterior.residuals_and_jacobian(at[None])
    precision = jacobian.T @ jacobian + np.eye(len(at)) / EVEN_STD**2
    return np.asarray(np.sqrt(np.diag(np.linalg.inv(precision))[:COUNT]))
