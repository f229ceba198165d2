"""Misfits block by block: chi-squares of Gaussian rows, which are known on paper, and which of them is named."""

from math import log

import numpy as np
import pytest
from linear_press import NOISE, START, STD, TRUTH, random_slopes
from scipy.stats import chi2
from small_surrogate import REACH_MM, LinearRows, linear_surrogate, white_noise

from device.measurement.parameters import PARAMETERS
from device.measurement.ramp_modes.fit import PressPosterior, best_fit
from device.measurement.ramp_modes.misfit_blocks import (
    ALONE,
    BLOCK_OF_COLUMN,
    BLOCKS,
    FAR_TILT_DEVIATIONS,
    UNLIKELY,
    BlockMisfit,
    Departure,
    critical_ratio,
    departing_block,
    log_tail,
    misfit_by_block,
)
from device.measurement.ramp_modes.radial_profile import COLUMN_COUNTS, COLUMNS, CONTRAST, FIRST, RESPONSE, SECOND
from device.measurement.ramp_modes.surrogate import MODULUS, OFFSET

COLUMNS_OF = dict(zip(BLOCKS, (CONTRAST, RESPONSE, FIRST, SECOND), strict=True))


@pytest.mark.parametrize("freedom", [1, 2, 33, 44, 220])
@pytest.mark.parametrize("ratio", [0.01, 0.5, 1.0, 3.0, 4500.0])
def test_the_tail_of_chi_square_is_exact_however_far_out(freedom, ratio):
    if ratio > 1000:
        wanted = 100 * freedom  # SciPy itself ends where the probability is no number any more
        assert log_tail(ratio * freedom, freedom) < log_tail(wanted, freedom) < -40
    else:
        assert log_tail(ratio * freedom, freedom) == pytest.approx(chi2.logsf(ratio * freedom, freedom), rel=1e-9)


@pytest.mark.parametrize("columns", [33, 44, 200])
def test_the_critical_ratio_is_exceeded_as_seldom_as_is_said(columns):
    assert critical_ratio(columns) == pytest.approx(chi2.isf(UNLIKELY, columns) / columns, abs=2e-6)


def test_blocks_are_the_parts_of_a_row_in_their_order():
    assert [int((number == BLOCK_OF_COLUMN).sum()) for number in range(len(BLOCKS))] == list(COLUMN_COUNTS)
    for number, block in enumerate(BLOCKS):
        assert np.all(BLOCK_OF_COLUMN[COLUMNS_OF[block]] == number)


@pytest.fixture(scope="module")
def correlated():
    """A covariance in which all columns go together, and what whitens it."""
    rng = np.random.default_rng(11)
    factor = np.tril(rng.normal(size=(COLUMNS, COLUMNS))) / np.sqrt(COLUMNS) + np.eye(COLUMNS)
    return factor, np.linalg.inv(factor)


def test_every_blocks_misfit_is_a_chi_square_of_its_columns_where_the_noise_is_right(correlated):
    """Of 400 Gaussian rows: a median of about 1 for each column, and as many above the critical ratio as are said."""
    factor, whitening = correlated
    away = factor @ np.random.default_rng(12).standard_normal((COLUMNS, 400))
    found = [misfit_by_block(whitening @ one, whitening, BLOCK_OF_COLUMN) for one in away.T]
    for block, columns in zip(BLOCKS, COLUMN_COUNTS, strict=True):
        squares = np.array([one[block].squares for one in found])
        assert {one[block].columns for one in found} == {columns}
        assert np.median(squares) == pytest.approx(chi2.median(columns), rel=0.04)
        assert np.median([one[block].ratio for one in found]) == pytest.approx(1.0, abs=0.05)
        assert np.std(squares) == pytest.approx(np.sqrt(2 * columns), rel=0.15)
        assert np.mean([one[block].log_probability < log(0.1) for one in found]) == pytest.approx(0.1, abs=0.05)
    assert sum(departing_block(one) is not None for one in found) <= 12  # 1 % of them, 4 at most by chance thrice


@pytest.mark.parametrize("block", BLOCKS)
def test_what_moves_one_block_leaves_the_others_as_they_are(correlated, block):
    """Marginal covariances: though all columns go together, only the block that was moved changes, and is named."""
    factor, whitening = correlated
    away = factor @ np.random.default_rng(13).standard_normal(COLUMNS)
    moved = away.copy()
    moved[COLUMNS_OF[block]] += 4.0
    before, after = (misfit_by_block(whitening @ one, whitening, BLOCK_OF_COLUMN) for one in (away, moved))
    assert {one for one in BLOCKS if after[one].squares != pytest.approx(before[one].squares)} == {block}
    assert departing_block(before) is None
    assert departing_block(after) == block


def of_ratios(*ratios):
    return {
        block: BlockMisfit(ratio * columns, columns)
        for block, ratio, columns in zip(BLOCKS, ratios, COLUMN_COUNTS, strict=True)
    }


def test_not_the_largest_ratio_is_named_but_the_most_unlikely():
    """A scan has one reference, and contrasts of five presses: 2.5 of 33 columns is less strange than 2.2 of 220."""
    found = of_ratios(1.0, 2.5, 1.0, 1.0) | {"contrast": BlockMisfit(2.2 * 220, 220)}
    assert found["reference_response"].ratio > found["contrast"].ratio
    assert departing_block(found) == "contrast"


def test_nothing_is_named_where_no_block_stands_out_alone():
    assert departing_block(of_ratios(1.3, 1.3, 1.3, 1.3)) is None
    assert departing_block(of_ratios(5.3, 1.0, 3.7, 5.1)) is None  # a skin of 1 % of texture
    assert departing_block(of_ratios(2.7, 1.8, 100.0, 1.0)) == "first_harmonic"  # a tilt takes the others along


def test_alone_is_so_many_times_less_likely_than_the_next():
    one, other = of_ratios(1, 4, 1, 1), of_ratios(1, 4, 3.7, 1)
    assert other["first_harmonic"].log_probability * ALONE < other["reference_response"].log_probability
    assert (departing_block(one), departing_block(other)) == ("reference_response", None)


def test_a_probe_that_leant_far_is_named_whatever_shows_most():
    skin = of_ratios(5.0, 1.0, 2.0, 1.0)
    assert Departure(skin).block == "contrast"
    assert Departure(skin, FAR_TILT_DEVIATIONS).block == "contrast"
    assert Departure(skin, FAR_TILT_DEVIATIONS + 0.1).block == "first_harmonic"


def test_a_press_is_told_block_by_block_of_the_fit_that_answers_it():
    """The slopes are in the reference response alone: rows of the model are 1 everywhere, but for what was fitted."""
    surrogate, rng = linear_surrogate(random_slopes()), np.random.default_rng(7)
    rows = surrogate.rows(TRUTH[None]) + rng.normal(0, STD, (40, COLUMNS))
    posteriors = [PressPosterior(row, surrogate, NOISE) for row in rows]
    best = [best_fit(posterior, START) for posterior in posteriors]
    found = [posterior.misfit_by_block(at) for posterior, at in zip(posteriors, best, strict=True)]
    for block in BLOCKS:
        fitted = 8 if block == "reference_response" else 0
        assert np.mean([one[block].squares for one in found]) == pytest.approx(
            found[0][block].columns - fitted, rel=0.1
        )
    whole = np.sum(posteriors[0].residuals(best[0]) ** 2)
    assert sum(one.squares for one in found[0].values()) == pytest.approx(whole)  # white noise: blocks are apart


def test_the_presses_of_a_scan_are_told_together_and_their_reference_once():
    slopes = np.random.default_rng(5).normal(0.0, 0.02, (len(PARAMETERS), COLUMNS))
    slopes[MODULUS] = 0.0
    slopes[OFFSET, RESPONSE] = 0.0
    surrogate = LinearRows(slopes)
    at = np.append(np.zeros(OFFSET), [0.2, 0.5, -0.3])
    each = np.column_stack([np.zeros((3, OFFSET)), REACH_MM / 2 * (at[OFFSET:] + 1) - 1])
    rows = surrogate.rows(each)
    rows[2, SECOND] += 0.1
    posterior = PressPosterior(rows, surrogate, white_noise(0.02), REACH_MM)
    found = posterior.misfit_by_block(at)
    assert [found[block].columns for block in BLOCKS] == [
        3 * COLUMN_COUNTS[0],
        COLUMN_COUNTS[1],
        *np.multiply(3, COLUMN_COUNTS[2:]),
    ]
    assert departing_block(found) == "second_harmonic"
