"""Intervals of posteriors that are Gaussian, or a few Gaussians by the modulus: their ends are known on paper."""

from dataclasses import replace

import numpy as np
import pytest
from small_surrogate import LinearRows, white_noise

from device.measurement.parameters import COUNT, EVEN_STD, PARAMETERS
from device.measurement.ramp_modes.fit import PressPosterior
from device.measurement.ramp_modes.intervals import CHI_SQUARE_90, SMALLEST_SHARE, intervals_of
from device.measurement.ramp_modes.posterior import CELLS, MIDDLES, ModulusCells, PressFit, sample_press
from device.measurement.ramp_modes.radial_profile import COLUMNS, RESPONSE
from device.measurement.ramp_modes.surrogate import DEPTH, MODULUS, SIZE, TISSUE

DEVIATIONS = 1.6449
"""Nine in ten of a Gaussian lie within so many."""
MANY = np.full(CELLS, 1e9)
K, SLAB = len(PARAMETERS), PARAMETERS.index("slab_thickness_mm")


def fit_of(shares, means, spreads, mean=0.0, spread=0.1):
    """Return a posterior whose size has shares, means and spreads in the first cells of the modulus.

    Mean and spread of the whole, and of all else in every cell, are those stated.
    """
    count = len(shares)
    share, in_cells, wide = np.zeros(CELLS), np.full((CELLS, K), mean), np.full((CELLS, K), spread)
    share[:count], in_cells[:count, SIZE], wide[:count, SIZE] = shares, means, spreads
    in_cells[:, MODULUS] = MIDDLES
    whole = np.full(K, mean), np.full(K, spread)
    return PressFit(np.full(K, mean), *whole, 1000.0, ModulusCells(share, in_cells, wide, MANY))


def size_ends(fit):
    found = intervals_of(fit)
    return found.low[SIZE], found.high[SIZE]


def test_nine_in_ten_of_a_gaussian_lie_within_the_square_root_of_chi_square():
    assert np.sqrt(CHI_SQUARE_90) == pytest.approx(DEVIATIONS, abs=1e-4)


@pytest.mark.parametrize("mean", [0.0, 0.3, -0.6])
def test_a_gaussian_posterior_has_its_mean_and_1_645_deviations_on_either_side(mean):
    """The same in every cell of the modulus: profiling over it changes nothing."""
    likely = np.exp(-0.5 * ((MIDDLES - mean) / 0.1) ** 2)
    found = intervals_of(fit_of(likely / likely.sum(), mean, 0.1, mean=mean))
    np.testing.assert_allclose(found.low, mean - 0.1 * DEVIATIONS, atol=1e-5)
    np.testing.assert_allclose(found.high, mean + 0.1 * DEVIATIONS, atol=1e-5)
    assert found.is_identifiable.all()


def test_two_cells_of_other_means_have_an_interval_over_both():
    """Equally likely: each keeps its own 1.645 deviations, and the interval is what both hold and what is between."""
    assert size_ends(fit_of([0.5, 0.5], [-0.3, 0.4], [0.1, 0.1])) == pytest.approx(
        (-0.3 - 0.1 * DEVIATIONS, 0.4 + 0.1 * DEVIATIONS), abs=1e-4
    )


def test_a_less_likely_cell_adds_less_by_the_likelihood_ratio():
    """Densities of one spread are as the shares: half as likely leaves (2.7055 - 2 ln 2) of chi-square."""
    low, high = size_ends(fit_of([0.5, 0.25], [-0.3, 0.4], [0.1, 0.1]))
    assert low == pytest.approx(-0.3 - 0.1 * DEVIATIONS, abs=1e-4)
    assert high == pytest.approx(0.4 + 0.1 * np.sqrt(CHI_SQUARE_90 - 2 * np.log(2)), rel=1e-9)


def test_a_narrow_cell_is_as_much_likelier_at_its_peak_as_it_is_narrow():
    """Peak densities are share over spread: 0.5 / 0.1 against 0.25 / 0.05 are the same."""
    assert size_ends(fit_of([0.5, 0.25], [-0.3, 0.4], [0.1, 0.05])) == pytest.approx(
        (-0.3 - 0.1 * DEVIATIONS, 0.4 + 0.05 * DEVIATIONS), abs=1e-4
    )


@pytest.mark.parametrize("share", [0.3, 0.2, 1e-3, 0.1 * SMALLEST_SHARE, 0.0])
def test_a_cell_too_unlikely_adds_nothing(share):
    """exp(-2.7055 / 2) = 0.258 of the likeliest is where nothing is left: 0.3 to 0.7 is more, 0.2 to 0.8 is less."""
    fit = fit_of([1 - share, share], [-0.3, 0.9], [0.1, 0.1])
    assert (size_ends(fit)[1] > 0.9) == (share / (1 - share) > np.exp(-CHI_SQUARE_90 / 2))
    if share <= 0.2:
        assert size_ends(fit) == pytest.approx((-0.3 - 0.1 * DEVIATIONS, -0.3 + 0.1 * DEVIATIONS), abs=1e-4)


@pytest.mark.parametrize("spread", [0.0, 1e-5])
def test_a_cell_of_all_but_a_single_sample_is_no_dense_one(spread):
    """Of its own spread it would outshine everything; as wide as the others, and a hundredth, it adds nothing."""
    fit = fit_of([0.99, 0.01], [0.0, 0.9], [0.1, spread])
    few = np.where(np.arange(CELLS) == 1, 1.0, MANY)
    fit = replace(fit, by_modulus=fit.by_modulus._replace(worth=few))
    assert size_ends(fit) == pytest.approx((-0.1 * DEVIATIONS, 0.1 * DEVIATIONS), abs=1e-4)


def test_the_modulus_itself_is_profiled_over_nothing():
    fit = fit_of([0.0, 0.5, 0.5], [0.0, -0.3, 0.4], [0.1, 0.1, 0.1], mean=0.2)
    found = intervals_of(fit)
    assert (found.low[MODULUS], found.high[MODULUS]) == pytest.approx(
        (0.2 - 0.1 * DEVIATIONS, 0.2 + 0.1 * DEVIATIONS), abs=1e-4
    )


def test_an_interval_ends_where_the_range_does():
    low, high = size_ends(fit_of([1.0], [0.95], [0.1], mean=0.95))
    assert (low, high) == (pytest.approx(0.95 - 0.1 * DEVIATIONS, abs=1e-4), 1.0)


@pytest.mark.parametrize(("spread", "is_known"), [(0.49 * EVEN_STD, True), (0.51 * EVEN_STD, False)])
def test_what_is_not_narrowed_down_to_half_keeps_the_whole_range(spread, is_known):
    found = intervals_of(fit_of([1.0], [0.0], [0.1], spread=spread))
    assert (found.is_identifiable == is_known).all()
    assert (size_ends(fit_of([1.0], [0.0], [0.1], spread=spread)) == (-1.0, 1.0)) != is_known


def test_an_interval_that_is_the_whole_range_narrows_nothing_down():
    found = intervals_of(fit_of([0.5, 0.5], [-0.95, 0.95], [0.1, 0.1]))
    assert (found.low[SIZE], found.high[SIZE]) == (-1.0, 1.0)
    assert not found.is_identifiable[SIZE]
    assert found.is_identifiable[DEPTH]


def test_a_posterior_that_tells_nothing_leaves_everything():
    """As `sample_press` says of too few samples: even cells of the ranges' spread."""
    found = intervals_of(fit_of(np.full(CELLS, 1 / CELLS), 0.3, EVEN_STD, spread=EVEN_STD))
    np.testing.assert_array_equal(found.low, -1.0)
    np.testing.assert_array_equal(found.high, 1.0)
    assert not found.is_identifiable.any()
    assert found.low.shape == (COUNT,)


HANGS, STD, PRESSES = 0.3, 0.05, 100
"""Size and modulus are seen as size + 0.3 modulus, with noise of 0.05; the modulus shows in nothing else."""


@pytest.fixture
def hanging() -> LinearRows:
    """All parameters but the modulus have a column of their own, in which nothing is a contrast."""
    slopes = np.zeros((K, COLUMNS))
    slopes[np.arange(K), RESPONSE.start + np.arange(K)] = 1.0
    slopes[MODULUS] = HANGS * slopes[SIZE]
    return LinearRows(slopes)


def covered_at(hanging, modulus_from, modulus_to, presses=PRESSES):
    """Return how often profiled and plain intervals of the size hold it, for true moduli between two ends.

    Tissue is soft and slabs are thick, where every modulus is possible.
    """
    rng, held = np.random.default_rng(8), []
    for _ in range(presses):
        truth = rng.uniform(-0.5, 0.5, K)
        truth[MODULUS], truth[TISSUE], truth[SLAB] = rng.uniform([modulus_from, -1, 0], [modulus_to, -0.5, 0.5])
        row = hanging.rows(truth[None])[0] + rng.normal(0, STD, COLUMNS)
        fit = sample_press(PressPosterior(row, hanging, white_noise(STD)), np.zeros(K))
        low, high = size_ends(fit)
        assert high - low < 2
        held.append((low <= truth[SIZE] <= high, abs(truth[SIZE] - fit.mean[SIZE]) < DEVIATIONS * fit.spread[SIZE]))
    return np.mean(held, axis=0)


@pytest.mark.long
def test_a_size_that_hangs_on_the_modulus_is_covered_at_both_ends_of_it_where_a_plain_interval_fails(hanging):
    """The modulus keeps its even prior, and so the size 0.3 x 0.577 about the middle.

    In the outermost octiles the mean of the size is 0.3 x 0.875 off, and a plain interval reaches 1.645 x 0.18: noise
    decides. Profiled, it reaches 1.645 x 0.05 beyond the outermost cell's mean, whose modulus is 0.03 off on average:
    the truth is missed on that side alone, by a noise of 1.645 - 0.3 x 0.03 / 0.05 = 1.47 deviations: in 7 %.
    """
    profiled, plain = np.transpose([covered_at(hanging, *end) for end in ((-1.0, -0.75), (0.75, 1.0))])
    assert (profiled >= 0.85).all()
    assert plain.mean() < 0.8


def test_in_the_middle_of_the_moduli_a_profiled_interval_is_wider_than_it_need_be(hanging):
    """It reaches from what the softest allow to what the hardest do: 0.3 either way, and noise is 0.05."""
    assert covered_at(hanging, -0.2, 0.2, presses=10)[0] == 1.0


@pytest.mark.parametrize(("share", "is_open"), [(0.3, True), (0.25, False)])
def test_a_modulus_whose_range_ends_where_it_is_still_likely_is_open_there(share, is_open):
    """0.258 of the likeliest cell is where a likelihood ratio of 90 % ends. Its mean and spread would close it."""
    falling = np.linspace(1.0, share, 4)
    shares = np.concatenate([np.full(CELLS - 4, 1e-6), falling])
    fit = fit_of(shares / shares.sum(), 0.0, 0.1, mean=0.6, spread=0.2)
    for turned in (
        fit,
        replace(fit, mean=-fit.mean, by_modulus=fit.by_modulus._replace(share=fit.by_modulus.share[::-1])),
    ):
        found = intervals_of(turned)
        ends = sorted(abs(np.array([found.low[MODULUS], found.high[MODULUS]])))
        assert ends == pytest.approx([0.6 - 0.2 * DEVIATIONS, 1.0 if is_open else 0.6 + 0.2 * DEVIATIONS], abs=1e-4)
