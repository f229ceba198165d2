"""The posterior of presses of a commissioned probe, where the inclusion may lie on any side of what looks bright.

As `fit.PressPosterior`, but for two coordinates of each press instead of one: where the inclusion lies along the bright
side and across it. Rows of the forward model are in the inclusion's direction; they are turned into what is seen.
Source: docs/own_probe.md; that a scan's data count in part: Miller & Dunson, JASA 114 (2019), coarsened posteriors.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, HIGH, PARAMETERS, denormalise, is_possible
from device.measurement.ramp_modes.answers import UnlikeDesign
from device.measurement.ramp_modes.commissioned.discrepancy import Discrepancy
from device.measurement.ramp_modes.commissioned.own_probe import OwnProbe, Place, RowChanges, turned_columns
from device.measurement.ramp_modes.fit import lower_product, whitening
from device.measurement.ramp_modes.misfit_blocks import BLOCK_OF_COLUMN, BlockMisfit, RowBlock, misfit_by_block
from device.measurement.ramp_modes.noise import FURTHER, LOADS, PressNoise, light_ratio, smooth_errors
from device.measurement.ramp_modes.radial_profile import (
    COLUMNS,
    FIRST,
    FIRST_ACROSS,
    RESPONSE,
    SECOND,
    SECOND_ACROSS,
    SEEN_COLUMNS,
    SeenPresses,
)
from device.measurement.ramp_modes.surrogate import OFFSET, PressRows
from device.measurement.recording.ring_means import RING_RADII_MM

AXES = 2
OF_FIRST, OF_SECOND = (slice(one.start - COLUMNS, one.stop - COLUMNS) for one in (FIRST_ACROSS, SECOND_ACROSS))
"""Harmonics among those across the bright side."""
SCAN_VARIANCE = 1.4
"""By how much the covariance of a scan's presses counts as larger. What is unlike the design is taken at the best fit,
but changes with tissue and place, and a scan tells these closely: of 54 scans drawn from what is believed (seeds 5 and
31 of `believed_presses`) 80 % of sizes that are determined are covered without it, 88 % with it."""
LEAST = 1e-4
"""An offset this small is on the axis, in units of the reach: there its direction means nothing."""
BLOCK_OF_SEEN = np.concatenate([BLOCK_OF_COLUMN, *(BLOCK_OF_COLUMN[along] for along in (FIRST, SECOND))])
"""Number of the block of each column of what is seen of a press: harmonics along and across are one block."""
OF_FURTHER = np.concatenate([FURTHER, np.arange(COLUMNS, SEEN_COLUMNS)])
"""Columns of a further press of a scan: all but the reference response, which is that of the first."""


class OwnPosterior:
    """How well parameters explain what is seen of a press, or of a scan's presses, of a commissioned probe.

    Coordinates [8 + 2 N] are those of `parameters.normalise` but for the offset: each of N presses has two at the end,
    along the bright side and across it, over the reach.
    """

    def __init__(
        self, seen: SeenPresses, surrogate: PressRows, noise: PressNoise, own: OwnProbe, reach_mm: float, at: Array
    ) -> None:
        """Take presses, and coordinates [8 + 2 N] near the truth, about which the probe's changes are linear.

        Raises `ValueError` where the harmonics across the bright side were not read.
        """
        if seen.across is None:
            raise ValueError("presses of a commissioned probe without the harmonics across their bright side")
        self.seen, self.surrogate, self.noise, self.own, self.reach_mm = seen, surrogate, noise, own, reach_mm
        self.presses, self.dimensions = len(seen.rows), OFFSET + AXES * len(seen.rows)
        self._units = reach_mm / float(HIGH[OFFSET])  # of `normalise`, for one of the offset's own
        self._whole = np.hstack([seen.rows, seen.across])
        self._changes = self._changes_at(at)
        self._seen = _joined((self._whole - self._changes.shift)[None])[0]
        self._factor = _joined(self._changes.factor.transpose(2, 0, 1)).T
        covariance = seen_covariance(seen.rows, seen.across, noise) + self._factor @ self._factor.T
        self._widened = SCAN_VARIANCE**0.5 if self.presses > 1 else 1.0
        self.columns = [slice(one[0], one[-1] + 1) for one in _places(self.presses)]
        self._whitening = whitening(covariance, self.columns) / self._widened

    def likeliest_changes(self, at: Array) -> Array:
        """Return the likeliest of the K changes that presses share [K], in deviations, given coordinates [8 + 2 N]."""
        return np.asarray(-self._factor.T @ self.weighted(self._widened**2 * self.residuals(at)))

    def moved(self, at: Array, changes: Array) -> Array:
        """Return what changes of so many deviations [K] do to what is seen [S], at coordinates [8 + 2 N]."""
        there = self._changes_at(at)
        return np.asarray(_joined((there.shift + there.factor @ changes)[None])[0])

    def whitened(self, changes: Array) -> Array:
        """Return changes [S, k] of what is seen in standard deviations of what is believed of it."""
        return lower_product(self._whitening, changes, self.columns)

    def unlike(self, at: Array, number: int) -> UnlikeDesign:
        """Return what makes one of the presses another than the forward model's, at coordinates [8 + 2 N]."""
        place = self._place(at[None])
        seen = _turned(self._rows(place), place.angle_rad)[number]
        shift, factor = self._changes.shift[number], self._changes.factor[number]
        across = seen[SECOND_ACROSS] + shift[SECOND_ACROSS]
        return UnlikeDesign(seen[:COLUMNS], shift[:COLUMNS], factor[:COLUMNS], across)

    @property
    def log_volume(self) -> float:
        """Logarithm of the density at the middle of what is believed of noise, but for a constant."""
        return float(np.log(np.diag(self._whitening)).sum())

    def log_evidence(self, at: Array) -> float:
        """Return the logarithm of how likely what is seen is, but for a constant, by Laplace's approximation about the
        best fit [8 + 2 N]: against noise as it is believed, of scans too.
        """
        (residuals,), (jacobian,) = (self._widened * one for one in self.residuals_and_jacobian(at[None]))
        precision = jacobian.T @ jacobian + np.eye(self.dimensions) / EVEN_STD**2
        log_volume = self.log_volume + len(residuals) * np.log(self._widened)
        return float(log_volume - 0.5 * residuals @ residuals - 0.5 * np.linalg.slogdet(precision)[1])

    def whitened_changes(self, at: Array) -> Array:
        """Return what a unit of each direction of `DIRECTIONS` changes [S, COUNT], at coordinates [8 + 2 N]."""
        place = self._place(at[None])
        changes = self.own.derivatives.changes(place.normalised, self._rows(place))
        seen = turned_columns(changes, place.angle_rad[:, None, None])
        return np.asarray(self._whitening @ _joined(seen.transpose(1, 0, 2)).T)

    def whitened_lack(self, at: Array, discrepancy: Discrepancy) -> Array:
        """Return what a discrepancy's factor changes [S, R], at coordinates [8 + 2 N]."""
        place = self._place(at[None])
        spread = discrepancy.spread(place.normalised, self._rows(place)).transpose(2, 0, 1)
        return np.asarray(self._whitening @ _joined(turned_columns(spread, place.angle_rad[:, None])).T)

    def misfit_ratio(self, at: Array) -> float:
        """Return squared residuals over their number, against noise as it is believed, at coordinates [8 + 2 N]."""
        return float(np.mean((self._widened * self.residuals(at)) ** 2))

    def misfit_by_block(self, at: Array) -> dict[RowBlock, BlockMisfit]:
        """Return the misfit of each block of what is seen, at coordinates [8 + 2 N]."""
        (blocks,) = _joined(np.tile(BLOCK_OF_SEEN, (1, self.presses, 1)))
        return misfit_by_block(self._widened * self.residuals(at), self._widened * self._whitening, blocks)

    def tilt_deviations(self, at: Array) -> float:
        """Return how far the probe leant on the lesion in the press that leant most, at coordinates [8 + 2 N].

        That is the mean of the tilt's posterior, given those coordinates, in standard deviations of a hand's habit.
        """
        place = self._place(at[None])
        tilted = self.own.tilted_columns(place, self._rows(place))
        told = self._widened**2 * (self._whitening.T @ self.residuals(at))
        parts = zip(_places(self.presses), tilted, strict=True)
        return max(
            float(np.linalg.norm(told[own] @ (one[OF_FURTHER] if number else one)))
            for number, (own, one) in enumerate(parts)
        )

    def residuals(self, at: Array) -> Array:
        """Return whitened residuals [..., S] at coordinates [..., 8 + 2 N], in their precision."""
        points = at.reshape(-1, self.dimensions)
        place = self._place(points)
        seen = _turned(self._rows(place), place.angle_rad).reshape(len(points), self.presses, SEEN_COLUMNS)
        residuals = (_joined(seen) - self._seen.astype(at.dtype)) @ self._whitening.T.astype(at.dtype)
        return np.asarray(residuals.reshape(*at.shape[:-1], len(self._seen)))

    def residuals_and_jacobian(self, at: Array) -> tuple[Array, Array]:
        """Return the same [n, S] at coordinates [n, 8 + 2 N], and their derivatives [n, S, 8 + 2 N]."""
        place = self._place(at)
        rows, slopes = self.surrogate.rows_and_jacobian(place.normalised, self._directions(place))
        seen, angle = _turned(rows, place.angle_rad), place.angle_rad[:, None]
        shared = _turned(slopes.transpose(2, 0, 1), place.angle_rad).transpose(1, 2, 0)
        outwards = 2 * self._units * shared[..., OFFSET]
        around = _by_angle(rows, place.angle_rad) / self._from_axis(at)[:, None]
        along = outwards * np.cos(angle) - around * np.sin(angle)
        across = outwards * np.sin(angle) + around * np.cos(angle)
        of_presses = len(at), self.presses, SEEN_COLUMNS
        jacobian = np.zeros((len(at), len(self._seen), self.dimensions))
        alike = _joined(shared[..., :OFFSET].reshape(*of_presses, OFFSET))
        jacobian[..., :OFFSET] = lower_product(self._whitening, alike, self.columns)
        places = np.stack([along, across], axis=-1).reshape(*of_presses, AXES)
        for number, own in enumerate(self.columns):  # a press's place moves no other press
            moved = places[:, number, OF_FURTHER if number else slice(None)]
            first = OFFSET + AXES * number
            jacobian[:, own.start :, first : first + AXES] = self._whitening[own.start :, own] @ moved
        residuals = (_joined(seen.reshape(of_presses)) - self._seen) @ self._whitening.T
        return residuals, jacobian

    def weighted(self, whitened: Array) -> Array:
        """Return residuals over their covariance [S], of whitened ones [S]."""
        return np.asarray(whitened @ self._whitening)

    def log_density(self, at: Array) -> Array:
        """Return the logarithm of the posterior density [n], but for a constant, at coordinates [n, 8 + 2 N].

        Coordinates are even within their ranges before the press, places over the disk.
        """
        log = np.full(len(at), -np.inf)
        from_axis = self._from_axis(at).reshape(len(at), self.presses)
        inside = np.all(np.abs(at[:, :OFFSET]) <= 1, axis=1) & np.all(from_axis <= 1, axis=1)
        inside &= is_possible(denormalise(at[:, : OFFSET + 1]))
        residuals = self.residuals(at[inside].astype(np.float32))  # single precision: see `PressRows`
        log[inside] = -0.5 * np.sum(residuals**2, axis=1)
        return log

    def _changes_at(self, at: Array) -> RowChanges:
        place = self._place(at[None])
        return self.own.changes(place, self._rows(place), self._whole)

    def _rows(self, place: Place) -> Array:
        """Return the forward model's rows [n N, P], in the inclusions' own directions."""
        return self.surrogate.rows(place.normalised, self._directions(place))

    @staticmethod
    def _directions(place: Place) -> Array:
        return place.bright_side_rad + place.angle_rad

    def _place(self, at: Array) -> Place:
        """Return where the inclusions of n N presses lie."""
        each = np.empty((len(at), self.presses, len(PARAMETERS)), at.dtype)
        each[:, :, :OFFSET] = at[:, None, :OFFSET]
        each[:, :, OFFSET] = 2 * self._units * self._from_axis(at).reshape(len(at), self.presses) - 1
        xy = at[:, OFFSET:].reshape(-1, AXES)
        angle = np.arctan2(xy[:, 1], xy[:, 0])
        return Place(each.reshape(-1, len(PARAMETERS)), angle, np.tile(self.seen.direction_rad, len(at)))

    @staticmethod
    def _from_axis(at: Array) -> Array:
        """Return the offsets [n N] over the reach, none below `LEAST`."""
        return np.asarray(np.maximum(np.linalg.norm(at[:, OFFSET:].reshape(-1, AXES), axis=1), LEAST))


def seen_of(seen: Array, direction_rad: Array) -> SeenPresses:
    """Return presses of which all columns [N, S] are told, and directions [N] of their bright sides."""
    second = np.stack([seen[:, SECOND], seen[:, SECOND_ACROSS]], axis=1)
    first = seen[:, FIRST_ACROSS].reshape(len(seen), LOADS, -1)
    return SeenPresses(seen[:, :COLUMNS], second.reshape(len(seen), 2, LOADS, -1), direction_rad, first)


def seen_with_noise(seen: Array, noise: PressNoise, rng: np.random.Generator) -> Array:
    """Return what is seen of presses with one reference [N, S], whose response is the same, with noise."""
    covariance = seen_covariance(seen[:, :COLUMNS], seen[:, COLUMNS:], noise)
    error = np.linalg.cholesky(covariance) @ rng.standard_normal(len(covariance))
    noisy = seen + 0.0
    for number, part in enumerate(np.split(error, [place[0] for place in _places(len(seen))[1:]])):
        noisy[number, OF_FURTHER if number else slice(None)] += part
    noisy[1:, RESPONSE] = noisy[0, RESPONSE]
    return noisy


def to_bright_side(seen: Array, direction_rad: Array) -> SeenPresses:
    """Return presses as a profile has them, harmonics along their bright side, of columns [N, S] along directions [N].

    As in `radial_profile.bright_side_rad`: of all rings but the outermost, which the frame cuts.
    """
    first = [seen[:, part].reshape(len(seen), LOADS, -1)[:, :, :-1].mean(axis=1) for part in (FIRST, FIRST_ACROSS)]
    along, across = (part @ RING_RADII_MM[1:-1] for part in first)
    angle, turned = np.arctan2(across, along), np.array(seen)
    for order, columns, beside in ((1, FIRST, FIRST_ACROSS), (2, SECOND, SECOND_ACROSS)):
        cosine, sine = np.cos(order * angle)[:, None], np.sin(order * angle)[:, None]
        turned[:, columns] = seen[:, columns] * cosine + seen[:, beside] * sine
        turned[:, beside] = seen[:, beside] * cosine - seen[:, columns] * sine
    return seen_of(turned, direction_rad + angle)


def seen_covariance(rows: Array, across: Array, noise: PressNoise) -> Array:
    """Return the covariance of presses by `PressNoise`, across the bright side as along it, of [N, P] and [N, A].

    Of what is across, presses share nothing that is known.
    """
    joined = noise.scan_covariance(rows)
    camera, smooth, light = noise.camera, smooth_errors(noise.levels), light_ratio(rows)
    kept = [np.arange(COLUMNS), *[FURTHER] * (len(rows) - 1)]
    whole = np.zeros((len(joined) + across.size,) * 2)
    places = _places(len(rows))
    along = np.concatenate([place[: len(one)] for place, one in zip(places, kept, strict=True)])
    whole[np.ix_(along, along)] = joined
    for place, one, of_light, beside in zip(places, kept, light, across, strict=True):
        own = place[len(one) :]
        for columns, part in ((FIRST, OF_FIRST), (SECOND, OF_SECOND)):
            alike = camera[columns, columns] + smooth[columns, columns]
            gain, ratio = noise.levels.gain_ratio * beside[part], of_light[columns]
            whole[np.ix_(own[part], own[part])] = ratio[:, None] * ratio * alike + np.outer(gain, gain)
    return whole


def _places(presses: int) -> list[NDArray[np.intp]]:
    """Return where the columns of each press stand in one row."""
    counts = [SEEN_COLUMNS, *[len(OF_FURTHER)] * (presses - 1)]
    return np.split(np.arange(sum(counts)), np.cumsum(counts)[:-1])


def _joined(seen: Array) -> Array:
    """Return what is seen of N presses [n, N, S, ...] as one row of each [n, ...]."""
    further = seen[:, 1:, OF_FURTHER]
    count = further.shape[1] * further.shape[2]
    return np.concatenate([seen[:, 0], further.reshape(len(seen), count, *seen.shape[3:])], axis=1)


def _turned(rows: Array, angle_rad: Array) -> Array:
    """Return rows [..., n, P] as seen [..., n, S] at angles [n] from the bright side."""
    return turned_columns(rows, angle_rad[:, None])


def _by_angle(rows: Array, angle_rad: Array) -> Array:
    """Return the derivative [n, S] of what is seen of rows [n, P] by the angle."""
    slope = np.zeros((len(rows), SEEN_COLUMNS))
    for order, along, across in ((1, FIRST, FIRST_ACROSS), (2, SECOND, SECOND_ACROSS)):
        slope[:, along] = -order * rows[:, along] * np.sin(order * angle_rad[:, None])
        slope[:, across] = order * rows[:, along] * np.cos(order * angle_rad[:, None])
    return slope
