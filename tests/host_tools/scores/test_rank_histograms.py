"""Ranks, regions and energy score of posteriors that are known on paper: right, too narrow and moved."""

from functools import lru_cache

import numpy as np
import pytest

from device.measurement.parameters import COUNT
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.posterior import WeightedSamples
from host_tools.scores import rank_histograms as module
from host_tools.scores.rank_histograms import BINS, RankedPress, energy_score, rank_chapter, ranked, unevenness

PRESSES = 200


@lru_cache
def drawn(scale: float = 1.0, shift: float = 0.0) -> list[RankedPress]:
    """Truths are standard normal about a mean that the samples know, whose spread they state times `scale`."""
    rng, found = np.random.default_rng(1), []
    for _ in range(PRESSES):
        middle = rng.normal(0, 0.1, COUNT)
        at = middle + shift + 0.1 * scale * rng.standard_normal((800, COUNT))
        samples = WeightedSamples(at, np.full(800, 1 / 800), 800.0)
        found.append(ranked(samples, middle + 0.1 * rng.standard_normal(COUNT), rng))
    return found


def test_ranks_of_a_right_posterior_are_even_and_its_regions_hold_nine_in_ten():
    found = drawn()
    assert all(benchmark.passed for benchmark in module._benchmarks("standard", found))
    inside = np.array([one.in_region for one in found])
    assert inside.mean(axis=0) == pytest.approx(0.9, abs=0.04)


@pytest.mark.parametrize(("scale", "shift"), [(0.6, 0.0), (1.7, 0.0), (1.0, 0.05)])
def test_a_posterior_that_is_too_narrow_too_wide_or_moved_has_uneven_ranks(scale, shift):
    ranks = [
        benchmark for benchmark in module._benchmarks("standard", drawn(scale, shift)) if "ranks" in benchmark.quantity
    ]
    assert len(ranks) == COUNT
    assert not any(benchmark.passed for benchmark in ranks)


def test_a_weighted_sample_counts_by_its_weight():
    at = np.array([[-1.0, 0.0, 0.0], [0.0, 0.5, 0.2], [1.0, -0.3, 0.1], [1.0, 1.0, 0.9], [0.9, 1.0, -0.9]])
    samples = WeightedSamples(at, np.array([0.6, 0.2, 0.1, 0.05, 0.05]), 2.0)
    found = ranked(samples, np.array([0.5, 0.2, -1.0]), np.random.default_rng(1))
    np.testing.assert_allclose(found.rank, [0.8, 0.7, 0.0])


def test_the_energy_score_of_one_dimension_is_that_of_its_formula():
    """For samples a and b the score of a truth t between them is (b - a) / 2 - (b - a) / 2 = 0."""
    assert energy_score(np.array([[0.0], [1.0]]), np.array([0.25])) == pytest.approx(0.5 - 0.5)
    assert energy_score(np.array([[0.0], [1.0]]), np.array([2.0])) == pytest.approx(1.5 - 0.5)


def test_the_truths_own_distribution_has_the_least_energy_score():
    right, narrow, moved = (np.mean([one.energy_score for one in drawn(*how)]) for how in ((), (0.3,), (1.0, 0.1)))
    assert right < narrow
    assert right < moved
    assert right < np.mean([one.energy_score_of_ranges for one in drawn()]) / 2


def test_unevenness_is_pearsons_chi_square():
    even = (np.arange(BINS) + 0.5) / BINS
    assert unevenness(even) == 0.0
    assert unevenness(np.full(BINS, 0.1)) == pytest.approx((BINS - 1) ** 2 + BINS - 1)


def test_too_few_presses_are_refused_with_the_bound():
    with pytest.raises(InvalidQuantity, match="^presses is 79, but must be at least 80"):
        rank_chapter(None, presses=79)


def test_the_chapter_shows_every_unknown_of_both_modes(monkeypatch):
    monkeypatch.setattr(module, "ranked_presses", lambda *given, **named: drawn())
    chapter = rank_chapter(None, presses=PRESSES)
    histogram, scores = chapter.tables
    assert len(histogram.rows) == 2 * COUNT
    assert all(sum(float(cell[:-1]) for cell in row[1:]) == pytest.approx(100, abs=0.5) for row in histogram.rows)
    assert [row[0] for row in scores.rows] == ["standard", "precise"]
    assert chapter.passed
