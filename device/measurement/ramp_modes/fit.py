"""A profile row to its best fit: the forward model is turned round until it explains the press.

Levenberg-Marquardt from the network's estimate over everything that nobody tells the probe - tissue, slab, skin, offset
- within their ranges. How badly the best fit explains the press tells whether it is of one round inclusion.
Source: the iterated loop asked for by Lee & Won 2013, section V.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, HIGH, PARAMETERS, denormalise, is_possible
from device.measurement.ramp_modes.bounded_least_squares import least_squares
from device.measurement.ramp_modes.misfit_blocks import BLOCK_OF_COLUMN, BlockMisfit, RowBlock, misfit_by_block
from device.measurement.ramp_modes.noise import FURTHER, PressNoise, as_one_row
from device.measurement.ramp_modes.surrogate import OFFSET, PressRows

TOLERANCE, STEPS = 1e-6, 100
"""A fit ends when a step lowers its cost by so little of it, or raises it where no more was foretold to be gained.

Further steps, nearly half of all, move answers by less than the posterior's samples scatter.
"""


class Explained(Protocol):
    """How well coordinates explain what was seen."""

    def residuals(self, at: Array) -> Array:
        """Return whitened residuals [..., S] at coordinates [..., k]."""
        ...

    def residuals_and_jacobian(self, at: Array) -> tuple[Array, Array]:
        """Return the same [n, S] at coordinates [n, k], and their derivatives [n, S, k]."""
        ...

    def log_density(self, at: Array) -> Array:
        """Return the logarithm of the posterior density [n], but for a constant, at coordinates [n, k]."""
        ...


class PressPosterior:
    """The posterior of a press, or of a scan's presses: how well parameters explain their rows.

    Its coordinates [8 + N] are those of `parameters.normalise`, but for the offset: each of N presses has its own, at
    the end, from -1 on the axis to 1 at `reach_mm`.
    """

    def __init__(
        self,
        rows: Array,
        surrogate: PressRows,
        noise: PressNoise,
        reach_mm: float = float(HIGH[OFFSET]),
        direction_rad: Array | None = None,
    ) -> None:
        """Take the row [P] of a press, or the rows [N, P] of presses with one reference.

        `direction_rad` [N]: where the image says that the inclusion lies; one that is no number is not known.
        """
        presses = np.atleast_2d(rows)
        self._rows, self._direction_rad = presses, direction_rad
        self._surrogate, self._noise = surrogate, noise
        self._units = reach_mm / float(HIGH[OFFSET])  # of `normalise`, for one of the offset's own
        self._columns = _columns(*presses.shape)
        self._whitening = whitening(noise.scan_covariance(presses), self._columns)
        self.presses, self.dimensions = len(presses), OFFSET + len(presses)
        self._row = as_one_row(presses)

    def with_further(self, row: Array) -> PressPosterior:
        """Return the posterior of one press more, with a row [P] and without a direction; cheaper than anew."""
        further = copy(self)
        further._rows = np.vstack([self._rows, row])
        if self._direction_rad is not None:
            further._direction_rad = np.append(self._direction_rad, np.nan)
        shared, own = self._noise.further_covariance(self._rows, row)
        further._columns = _columns(*further._rows.shape)
        further._whitening = _extended(self._whitening, shared, own)
        further.presses, further.dimensions = self.presses + 1, self.dimensions + 1
        further._row = as_one_row(further._rows)
        return further

    def residuals(self, at: Array) -> Array:
        """Return whitened residuals [..., S] at coordinates [..., 8 + N], in their precision."""
        points = at.reshape(-1, self.dimensions)
        rows = self._surrogate.rows(self._of_presses(points), self._directions(len(points)))
        away = self._joined(self._apart(rows)) - self._row.astype(at.dtype)
        factor, residuals = self._whitening.astype(at.dtype), np.empty_like(away)
        for own in self._columns:
            residuals[:, own] = away[:, : own.stop] @ factor[own, : own.stop].T
        return residuals.reshape(*at.shape[:-1], len(self._row))

    def misfit_by_block(self, at: Array) -> dict[RowBlock, BlockMisfit]:
        """Return the misfit of each block of the presses' rows at coordinates [8 + N]."""
        blocks = np.concatenate([BLOCK_OF_COLUMN, *[BLOCK_OF_COLUMN[FURTHER]] * (self.presses - 1)])
        return misfit_by_block(self.residuals(at), self._whitening, blocks)

    def whitened(self, change: Array) -> Array:
        """Return changes [..., S, k] of the rows, or one change [S], in standard deviations of the noise."""
        if change.ndim == 1:
            return np.asarray(self._whitening @ change)
        return lower_product(self._whitening, change, self._columns)

    def residuals_and_jacobian(self, at: Array) -> tuple[Array, Array]:
        """Return the same [n, S] at coordinates [n, 8 + N], and their derivatives [n, S, 8 + N]."""
        rows, slopes = self._surrogate.rows_and_jacobian(self._of_presses(at), self._directions(len(at)))
        slopes = self._apart(slopes)
        jacobian = np.zeros((len(at), len(self._row), self.dimensions))
        jacobian[:, :, :OFFSET] = self._joined(slopes[..., :OFFSET])
        for number, columns in enumerate(self._columns):
            own = slopes[:, number, :, OFFSET] if number == 0 else slopes[:, number, FURTHER, OFFSET]
            jacobian[:, columns, OFFSET + number] = self._units * own
        joined = self._joined(self._apart(rows))
        return (joined - self._row) @ self._whitening.T, self.whitened(jacobian)

    def log_density(self, at: Array) -> Array:
        """Return the logarithm of the posterior density [n], but for a constant, at coordinates [n, 8 + N].

        Coordinates are even within their ranges before the press, where they are possible, but for offsets: a place is
        even over a disk.
        """
        log = np.full(len(at), -np.inf)
        inside = np.all(np.abs(at) <= 1, axis=1) & is_possible(denormalise(at[:, : OFFSET + 1]))
        residuals = self.residuals(at[inside].astype(np.float32))  # single precision: see `PressRows`
        log[inside] = np.log1p(at[inside, OFFSET:]).sum(axis=1) - 0.5 * np.sum(residuals**2, axis=1)
        return log

    def _of_presses(self, at: Array) -> Array:
        """Return the coordinates [n N, 9] of `normalise` of every press, for coordinates [n, 8 + N]."""
        each = np.empty((len(at), self.presses, len(PARAMETERS)), at.dtype)
        each[:, :, :OFFSET] = at[:, None, :OFFSET]
        each[:, :, OFFSET] = self._units * (at[:, OFFSET:] + 1) - 1
        return each.reshape(-1, len(PARAMETERS))

    def _directions(self, count: int) -> Array | None:
        """Return the directions [n N] of every press."""
        return None if self._direction_rad is None else np.tile(self._direction_rad, count)

    def _apart(self, of_presses: Array) -> Array:
        """Return what is of every press [n N, ...] as [n, N, ...]; n may be 0."""
        return of_presses.reshape(len(of_presses) // self.presses, self.presses, *of_presses.shape[1:])

    def _joined(self, parts: Array) -> Array:
        """Return parts [n, N, P, ...] of every press as `as_one_row` joins them [n, S, ...]."""
        count = (self.presses - 1) * len(FURTHER)
        further = parts[:, 1:, FURTHER].reshape(len(parts), count, *parts.shape[3:])
        return np.concatenate([parts[:, 0], further], axis=1)


def _columns(presses: int, first: int) -> list[slice]:
    """Return where the columns of each press stand in one row, of which the first has so many."""
    ends = [0, *(first + number * len(FURTHER) for number in range(presses))]
    return [slice(*pair) for pair in pairwise(ends)]


def whitening(covariance: Array, columns: Sequence[slice]) -> Array:
    """Return what whitens a covariance [S, S]: W with W C W' = 1, triangular, a press's columns after the other's.

    Those of a press are found from those before, which a further one leaves as they are.
    """
    found = np.zeros((0, 0))
    for own in columns:
        found = _extended(found, covariance[: own.start, own], covariance[own, own])
    return found


def lower_product(lower: Array, change: Array, columns: Sequence[slice]) -> Array:
    """Return the product of a lower triangular matrix [S, S] and changes [..., S, k], without the zeros above it."""
    return np.concatenate([lower[own, : own.stop] @ change[..., : own.stop, :] for own in columns], axis=-2)


def _extended(found: Array, shared: Array, own: Array) -> Array:
    """Return what whitens p columns more, of covariance `own` [p, p] and `shared` [S, p] with those of `found`."""
    before, count = len(found), len(found) + len(own)
    told = found @ shared
    extended = np.zeros((count, count))
    extended[:before, :before] = found
    extended[before:, before:] = np.linalg.inv(np.linalg.cholesky(own - told.T @ told))
    extended[before:, :before] = -extended[before:, before:] @ (told.T @ found)
    return extended


def best_fit(posterior: Explained, start: Array, *, tolerance: float = TOLERANCE) -> Array:
    """Return the coordinates [8 + N] that explain a row best, each held weakly to the middle of its range."""
    (best,) = best_fits(posterior, start[None], np.ones(len(start), dtype=bool), tolerance=tolerance)
    return np.asarray(best)


def best_fits(
    posterior: Explained, start: Array, free: NDArray[np.bool_], *, tolerance: float = TOLERANCE, steps: int = STEPS
) -> Array:
    """Return the best fits [n, 8 + N] begun at n points, in those of the coordinates that are `free`; others stay.

    They keep to the ranges, and may lie where these hold nothing possible: the density does not.
    """
    held = np.broadcast_to(np.eye(free.sum()) / EVEN_STD, (len(start), free.sum(), free.sum()))

    def residuals(at: Array, which: NDArray[np.intp]) -> tuple[Array, Array]:
        whole = start[which]
        whole[:, free] = at
        residual, jacobian = posterior.residuals_and_jacobian(whole)
        together = np.concatenate([residual, at / EVEN_STD], axis=1)
        return together, np.concatenate([jacobian[:, :, free], held[: len(at)]], axis=1)

    best = np.array(start)
    best[:, free] = least_squares(residuals, start[:, free], low=-1.0, high=1.0, tolerance=tolerance, steps=steps)
    return best
