"""Which part of a row its best fit does not explain: the misfit, block by block.

What an inclusion does is the contrast; contact law, layers and skin show in the reference response; a tilt in the first
harmonics; a stretched spot, or uneven light of the sides, in the second. A block's misfit takes its marginal
covariance, so it is a chi-square of its columns where model and noise are right, whatever the other blocks do. Blocks
have different numbers of columns, so not their ratios are compared but how unlikely they are.
Sources: Abramowitz & Stegun, Handbook of Mathematical Functions (1964), 26.4.4 and 26.4.5 (the tail of chi-square);
docs/robustness.md counts which block is named for what.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import erfc, lgamma, log, sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.ramp_modes.radial_profile import COLUMN_COUNTS

RowBlock = Literal["contrast", "reference_response", "first_harmonic", "second_harmonic"]
BLOCKS: tuple[RowBlock, ...] = ("contrast", "reference_response", "first_harmonic", "second_harmonic")
BLOCK_OF_COLUMN: NDArray[np.intp] = np.repeat(np.arange(len(BLOCKS)), COLUMN_COUNTS)
"""Number of the block of each column of a row [P]."""
UNLIKELY = 0.01 / len(BLOCKS)
"""So seldom a block's misfit is larger where model and noise are right: that any is, in one press of a hundred."""
ALONE = 2.0
"""A block stands out alone when the logarithm of its probability is so many times that of the next: one that departs
takes the best fit, and so the others, along."""


FAR_TILT_DEVIATIONS = 3.0
"""Further than by so many standard deviations of its habit no hand leans."""


class BlockMisfit(NamedTuple):
    """Of a block: squared residuals under its marginal covariance, summed up, and number of its columns."""

    squares: float
    columns: int

    @property
    def ratio(self) -> float:
        """Mean square of a column, about 1 where model and noise are right."""
        return self.squares / self.columns

    @property
    def log_probability(self) -> float:
        """Logarithm of the probability of as large a misfit where model and noise are right."""
        return log_tail(self.squares, self.columns)


class Departure(NamedTuple):
    """What the best fit of presses leaves: misfits of the blocks, and how far the probe leant on the lesion.

    `tilt_deviations`: in standard deviations of a hand's habit, where tilts are believed in: of a commissioned probe.
    """

    blocks: Mapping[RowBlock, BlockMisfit]
    tilt_deviations: float | None = None

    @property
    def block(self) -> RowBlock | None:
        """The block that departs, None where none stands out alone.

        Where the probe leant far it is the first harmonic, whichever block shows most: tilts that large are not linear.
        """
        if self.tilt_deviations is not None and self.tilt_deviations > FAR_TILT_DEVIATIONS:
            return "first_harmonic"
        return departing_block(self.blocks)


def misfit_by_block(
    residuals: Array, whitening: Array, block_of_column: NDArray[np.intp]
) -> dict[RowBlock, BlockMisfit]:
    """Return the misfit of each block from whitened residuals [S], what whitened them [S, S], and each column's block.

    `whitening` W has W C W' = 1 for the covariance C of the row.
    """
    factor = np.linalg.inv(whitening)
    away = factor @ residuals
    found: dict[RowBlock, BlockMisfit] = {}
    for number, block in enumerate(BLOCKS):
        own = block_of_column == number
        marginal = factor[own] @ factor[own].T
        found[block] = BlockMisfit(float(away[own] @ np.linalg.solve(marginal, away[own])), int(own.sum()))
    return found


def departing_block(found: Mapping[RowBlock, BlockMisfit]) -> RowBlock | None:
    """Return the block whose misfit is by far the most unlikely; None where none stands out alone."""
    unlikely = sorted((misfit.log_probability, block) for block, misfit in found.items())
    (least, block), (next_one, _), *_ = unlikely
    return block if least < log(UNLIKELY) and least < ALONE * next_one else None


def critical_ratio(columns: int) -> float:
    """Return the misfit per column that a block of so many exceeds with probability `UNLIKELY`, to 1e-6."""
    low, high = 1.0, 1000.0
    while high - low > 1e-6:
        middle = (low + high) / 2
        low, high = (middle, high) if log_tail(middle * columns, columns) > log(UNLIKELY) else (low, middle)
    return high


def log_tail(chi_square: float, freedom: int) -> float:
    """Return the logarithm of the probability that a chi-square of so many degrees of freedom is larger."""
    half = max(chi_square / 2, np.finfo(float).tiny)
    powers = np.arange(freedom // 2) + freedom % 2 / 2
    terms = [power * log(half) - half - lgamma(power + 1) for power in powers]
    if freedom % 2 and (rest := erfc(sqrt(half))) > 0:
        terms.append(log(rest))
    return float(np.logaddexp.reduce(terms))
