"""What is believed of a probe of one's own and of its presses, and how far that moves what they show.

Commissioning on phantoms tells of the probe; of a press nobody knows more than a hand's habits. Both are Gaussian, and
rows follow them by derivatives: so they shift what the forward model says, and widen its covariance. The directions of
a scan's presses are shared as they are: the probe by all, the lesion's skin and the reference press by those of one
scan, tilt and light by none. A tilt of a third of a degree outshines the side on which most inclusions lie. So the
harmonics across the bright side are read, too, and the inclusion lies anywhere beside it.
Source: docs/own_probe.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.commissioned.discrepancy import NOTHING, Discrepancy
from device.measurement.ramp_modes.commissioned.row_derivatives import (
    COUNT,
    DERIVATIVE_ARRAYS,
    NAMES,
    PAIR,
    RowDerivatives,
    owned_by,
    row_derivatives_of,
)
from device.measurement.ramp_modes.commissioned.squared_tilt import SMOOTH_FACTOR, of_habit, of_leaning
from device.measurement.ramp_modes.noise import LOADS, ErrorLevels
from device.measurement.ramp_modes.radial_profile import (
    COLUMNS,
    CONTRAST,
    FIRST,
    FIRST_ACROSS,
    FIRST_RINGS,
    SECOND,
    SECOND_ACROSS,
    SEEN_COLUMNS,
)

OF_DISCREPANCY = tuple(Discrepancy.__dataclass_fields__)
OWN_ARRAYS = (
    *(f"derivatives_{name}" for name in DERIVATIVE_ARRAYS),
    *("own_mean", "own_covariance", "own_levels"),
    *(f"own_discrepancy_{name}" for name in OF_DISCREPANCY),
)
"""Arrays that the file of a commissioned probe's surrogate has beside the others."""
ACTION = "commission the probe again"
LESION_TILT, BESIDE_TILT, ALONG = (
    NAMES.index(name) for name in ("tilt_lesion_deg", "tilt_beside_deg", "light_along_ratio")
)
SURE = 1e-8
"""A variance below which a direction counts as known."""
NOT_LINEAR_RATIO = 0.2
"""Where the face's edge lifts a tilt is not linear: its harmonic is believed to this part."""


class Place(NamedTuple):
    """Where inclusions of N presses lie: coordinates [N, 9], and angles [N] from the bright side, itself at [N]."""

    normalised: Array
    angle_rad: Array
    bright_side_rad: Array


class RowChanges(NamedTuple):
    """By how much what is seen of N presses is shifted [N, S], and a factor [N, S, K] of the covariance it shares."""

    shift: Array
    factor: Array


@dataclass(frozen=True, eq=False)
class OwnProbe:
    """`mean` [COUNT] and `covariance` [COUNT, COUNT] of the directions of `DIRECTIONS`, and `levels` of smooth errors.

    `discrepancy` is what no direction carries; the covariance is of what does not go with it. `uneven_ratio`: how
    uneven the tissue is, of what is believed of the directions of its layers; even tissue, 0, has none.
    Raises `InvalidQuantity` for arrays of another shape, and for a covariance that is none.
    """

    derivatives: RowDerivatives
    mean: Array
    covariance: Array
    levels: ErrorLevels
    discrepancy: Discrepancy = NOTHING
    uneven_ratio: float = 0.0

    def __post_init__(self) -> None:
        for name, found, expected in (("mean", self.mean, (COUNT,)), ("covariance", self.covariance, (COUNT, COUNT))):
            if found.shape != expected:
                raise InvalidQuantity(f"shape of the probe's {name}", found.shape, str(expected), ACTION)
        try:
            np.linalg.cholesky(self.covariance)
        except np.linalg.LinAlgError:
            raise InvalidQuantity("probe's covariance", "indefinite", "positive", ACTION) from None

    def changes(self, place: Place, rows: Array, presses_seen: Array | None = None) -> RowChanges:
        """Return how what is seen of presses with one reference moves; rows [N, P] are in the inclusion's direction.

        `presses_seen` [N, S] tell how far each leant, and so what the tilts' squares do; without them that is believed.
        """
        presses = len(rows)
        changes = self.derivatives.changes(place.normalised, rows)
        seen = turned_columns(changes, place.angle_rad[:, None, None])
        shared = np.concatenate([owned_by("probe"), owned_by("lesion")])
        parts = [np.einsum("nds,dk->nsk", seen[:, shared], self._factor(shared)), self._lacking(seen, place, rows)]
        parts.append(self._std(BESIDE_TILT) * self._beside(changes, place))
        if self.uneven_ratio:
            layers = owned_by("tissue")
            parts.append(self.uneven_ratio * np.einsum("nds,dk->nsk", seen[:, layers], self._factor(layers)))
        shift = self._linear_shift(seen, place, rows)
        squared, not_told = self._squared(changes, place, rows, None if presses_seen is None else presses_seen - shift)
        for number in range(presses):
            own = self._of_press(changes[number], place.angle_rad[number], place.bright_side_rad[number])
            columns = np.zeros((presses, SEEN_COLUMNS, own.shape[1] + not_told.shape[2]))
            columns[number] = np.hstack([own, not_told[number]])
            parts.append(columns)
        return RowChanges(shift + squared, np.concatenate(parts, axis=2))

    @property
    def may_be_uneven(self) -> bool:
        """Whether what is pressed may be uneven in depth; a casting is of one silicone."""
        return bool(np.diag(self.covariance)[owned_by("tissue")].max() > SURE)

    def tilted_columns(self, place: Place, rows: Array) -> Array:
        """Return what a standard deviation of each press's tilt does to it [N, S, 2], along the bright side and across.

        As of `changes`.
        """
        changes = self.derivatives.changes(place.normalised, rows)[:, LESION_TILT]
        each = [vector_columns(one, angle) for one, angle in zip(changes, place.angle_rad, strict=True)]
        return self._std(LESION_TILT) * np.array(each)

    def shift(self, place: Place, rows: Array) -> Array:
        """Return what is believed to shift what is seen of presses [N, S], as of `changes`."""
        changes = self.derivatives.changes(place.normalised, rows)
        linear = self._linear_shift(turned_columns(changes, place.angle_rad[:, None, None]), place, rows)
        return linear + self._squared(changes, place, rows)[0]

    def _linear_shift(self, seen: Array, place: Place, rows: Array) -> Array:
        scalar = np.array([number not in (LESION_TILT, BESIDE_TILT, ALONG, PAIR) for number in range(COUNT)])
        shift: Array = np.einsum("nds,d->ns", seen[:, scalar], self.mean[scalar])
        return shift + turned_columns(self.discrepancy.shift(place.normalised, rows), place.angle_rad[:, None])

    def _lacking(self, seen: Array, place: Place, rows: Array) -> Array:
        """Return what the forward model lacks and the probe's directions with it [N, S, R], in standard deviations."""
        spread = self.discrepancy.spread(place.normalised, rows).transpose(2, 0, 1)
        turned = turned_columns(spread, place.angle_rad[:, None]).transpose(1, 2, 0)
        return np.asarray(turned + np.einsum("nds,dr->nsr", seen[:, owned_by("probe")], self.discrepancy.of_probe))

    def _beside(self, changes: Array, place: Place) -> Array:
        """Return what a unit of the reference's tilt along the image's rows and columns does [N, S, 2]."""
        each = np.stack([
            vector_columns(one[BESIDE_TILT], angle) for one, angle in zip(changes, place.angle_rad, strict=True)
        ])  # fmt: skip
        along, across = each[..., 0], each[..., 1]
        angle = np.nan_to_num(place.bright_side_rad)[:, None]
        return np.stack(
            [along * np.cos(angle) - across * np.sin(angle), along * np.sin(angle) + across * np.cos(angle)], axis=2
        )

    def _of_press(self, changes: Array, angle_rad: float, bright_side_rad: float) -> Array:
        """Return what is one press' own, in standard deviations [S, K]."""
        vectors = [self._std(number) * vector_columns(changes[number], angle_rad) for number in (LESION_TILT, ALONG)]
        pair = self._std(PAIR) * pair_columns(changes[PAIR], bright_side_rad)[:, None]
        tilt = self._std(LESION_TILT) * changes[LESION_TILT, FIRST].reshape(LOADS, FIRST_RINGS)
        bent = NOT_LINEAR_RATIO * (tilt[:, :, None] * SMOOTH_FACTOR).reshape(LOADS * FIRST_RINGS, -1)
        not_linear = np.zeros((SEEN_COLUMNS, 2 * FIRST_RINGS))
        not_linear[FIRST, :FIRST_RINGS], not_linear[FIRST_ACROSS, FIRST_RINGS:] = bent, bent
        return np.hstack([*vectors, pair, not_linear])

    def _squared(self, changes: Array, place: Place, rows: Array, left: Array | None = None) -> tuple[Array, Array]:
        """Return what the tilts' squares move [N, S], and a factor [N, S, K] of what of it is not told.

        `left` [N, S] is what is seen less what is shifted. A press whose bright side is not known leans as is believed.
        """
        squares = self._tilt_of_rings(changes, BESIDE_TILT) ** 2
        habit = of_habit(squares)
        if left is None:
            return habit
        left = left - turned_columns(rows, place.angle_rad[:, None])
        tilt = self._tilt_of_rings(changes, LESION_TILT)[:, :, 1:].reshape(len(rows), -1)
        along, across = (np.sum(left[:, part] * tilt, axis=1) for part in (FIRST, FIRST_ACROSS))
        leant = np.column_stack([along, across]) / np.sum(tilt**2, axis=1, keepdims=True)
        told = of_leaning(squares, leant)
        is_told = ~np.isnan(place.bright_side_rad)
        return np.where(is_told[:, None], told[0], habit[0]), np.where(is_told[:, None, None], told[1], habit[1])

    def _tilt_of_rings(self, changes: Array, number: int) -> Array:
        """Return the first harmonic of a standard deviation of a tilt [n, K, J]; in the middle there is none."""
        tilt = self._std(number) * changes[:, number, FIRST].reshape(-1, LOADS, FIRST_RINGS)
        return np.concatenate([np.zeros((len(tilt), LOADS, 1)), tilt], axis=2)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return what a file holds, by the names in `OWN_ARRAYS`."""
        derivatives = {f"derivatives_{name}": part for name, part in self.derivatives.arrays().items()}
        levels = np.array([getattr(self.levels, name) for name in ErrorLevels.__dataclass_fields__])
        lacking = {f"own_discrepancy_{name}": getattr(self.discrepancy, name) for name in OF_DISCREPANCY}
        own = {"own_mean": self.mean, "own_covariance": self.covariance, "own_levels": levels}
        return derivatives | own | {name: np.asarray(part, np.float32) for name, part in lacking.items()}

    def _factor(self, chosen: NDArray[np.intp]) -> Array:
        return np.asarray(np.linalg.cholesky(self.covariance[np.ix_(chosen, chosen)]), np.float64)

    def _std(self, number: int) -> float:
        return float(np.sqrt(self.covariance[number, number]))


def turned_columns(rows: Array, angle_rad: float | Array) -> Array:
    """Return rows [..., P] in the inclusion's direction as seen [..., S], at an angle [..., 1] from the bright side."""
    seen = np.concatenate([rows, np.zeros((*rows.shape[:-1], SEEN_COLUMNS - COLUMNS), rows.dtype)], axis=-1)
    for order, along, across in ((1, FIRST, FIRST_ACROSS), (2, SECOND, SECOND_ACROSS)):
        seen[..., along] = rows[..., along] * np.cos(order * angle_rad)
        seen[..., across] = rows[..., along] * np.sin(order * angle_rad)
    return seen


def vector_columns(change: Array, angle_rad: float) -> Array:
    """Return what a vector's parts along and across the bright side do [S, 2], of one along the inclusion [P].

    Ring means follow the part along the inclusion, whose angle from the bright side is told; the first harmonic does
    not ask where the inclusion lies.
    """
    means = np.zeros(SEEN_COLUMNS)
    means[CONTRAST] = change[CONTRAST]
    seen = np.column_stack([means * np.cos(angle_rad), means * np.sin(angle_rad)])
    seen[FIRST, 0] = seen[FIRST_ACROSS, 1] = change[FIRST]
    return seen


def pair_columns(change: Array, bright_side_rad: float) -> Array:
    """Return what light of one pair of sides against the other does [S], of it along the rows of the image [P]."""
    seen, angle = np.zeros(SEEN_COLUMNS), 2 * np.nan_to_num(bright_side_rad)
    seen[SECOND], seen[SECOND_ACROSS] = np.cos(angle) * change[SECOND], -np.sin(angle) * change[SECOND]
    return seen


def own_probe_of(arrays: Mapping[str, NDArray[Any]]) -> OwnProbe:
    """Return what the arrays in `OWN_ARRAYS` say; raise `InvalidQuantity` when one is of another shape."""
    derivatives = row_derivatives_of({name: arrays[f"derivatives_{name}"] for name in DERIVATIVE_ARRAYS})
    levels, expected = arrays["own_levels"], (len(ErrorLevels.__dataclass_fields__),)
    if levels.shape != expected:
        raise InvalidQuantity("shape of the probe's error levels", levels.shape, str(expected), ACTION)
    mean, covariance = (np.asarray(arrays[name], np.float64) for name in ("own_mean", "own_covariance"))
    lacking = Discrepancy(*(np.asarray(arrays[f"own_discrepancy_{name}"], np.float64) for name in OF_DISCREPANCY))
    return OwnProbe(derivatives, mean, covariance, ErrorLevels(*map(float, levels)), lacking)
