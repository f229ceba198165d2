"""On rows that show size and depth with white noise, the networks tell what lies outside about as well as can be."""

import numpy as np
import pytest
from scipy.special import expit
from scipy.stats import norm
from small_surrogate import COLUMNS, white_noise

from device.measurement.parameters import PARAMETERS, denormalise, normalise
from device.measurement.ramp_modes.radial_profile import NETWORK_NAMES, network_rows
from host_tools.press_models import fit_surrogate, train_range
from host_tools.press_models.fit_surrogate import INCLUSION_REACH
from host_tools.press_models.noisy_presses import NoiseSampler, PressSet
from host_tools.press_models.press_samples import PressSamples
from host_tools.press_models.train_range import (
    THICKNESS,
    RangeBudget,
    RangeNetwork,
    WideSurrogate,
    draw_wide_parameters,
    is_outside,
    train_network,
    wide_press_set,
    wide_surrogate,
)

STD, COUNT, THICK_MM = 0.3, 20_000, 40.0
BUDGET = RangeBudget(members=1, steps=700)


@pytest.fixture(scope="module")
def press_set() -> PressSet:
    """Columns 44 and 45, whose noise does not depend on the light, are the coordinates of size and depth.

    In thick slabs nothing but the table's depths bounds both.
    """
    drawn = draw_wide_parameters(8 * COUNT, np.random.default_rng(1))
    normalised = normalise(drawn[drawn[:, THICKNESS] > THICK_MM][:COUNT])
    rows = np.zeros((COUNT, COLUMNS), np.float32)
    rows[:, 44:46] = normalised[:, :2]
    return PressSet(normalised.astype(np.float32), rows, np.zeros(COUNT), NoiseSampler(white_noise(STD)))


@pytest.fixture(scope="module")
def network(press_set) -> RangeNetwork:
    return train_network(press_set, 1, BUDGET, 1)


def seen_at(size: float, depth: float, count: int = 1) -> np.ndarray:
    """Return rows as networks read them: their first columns are those of the profile."""
    rows = np.zeros((count, len(NETWORK_NAMES)))
    rows[:, 44:46] = size, depth
    return rows


def on_paper(seen: np.ndarray) -> np.ndarray:
    """Return the probability [n] of lying outside, of places seen [n, 2] with white noise, the prior being even."""
    inside = norm.cdf((1 - seen) / STD) - norm.cdf((-1 - seen) / STD)
    return 1 - inside.prod(axis=1)


def test_the_odds_are_nearly_as_good_as_can_be(press_set, network):
    """Mean of -ln(probability of what is so), on fresh noise, against that of the exact probability."""
    rows = press_set.noisy(np.arange(COUNT), np.random.default_rng(9)).astype(float)
    outside = is_outside(press_set.normalised)
    found, exact = expit(network.log_odds(network_rows(rows))), np.clip(on_paper(rows[:, 44:46]), 1e-9, 1 - 1e-9)
    losses = [-np.mean(np.log(np.where(outside, p, 1 - p))) for p in (found, exact)]
    assert losses[1] < 0.4 < np.log(2)
    assert losses[0] < losses[1] + 0.03


def test_the_farther_beyond_an_end_the_larger_the_odds(network):
    for way in ((1.0, 0.0), (0.0, 1.0)):
        odds = network.log_odds(np.concatenate([seen_at(*np.multiply(way, far)) for far in (0.0, 0.7, 1.0, 1.4)]))
        assert (np.diff(odds) > 0).all()
        assert odds[0] < -1 < 1 < odds[-1]


def test_the_same_seed_gives_the_same_network(press_set):
    few = RangeBudget(members=2, steps=3)
    first, again, other = (train_network(press_set, seed, few, 1).log_odds(seen_at(1.0, 0.0)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all()


FEW_TERMS = {name: 0.5 * reach for name, reach in INCLUSION_REACH.items()} | {"size_mm": 18.0, "depth_mm": 16.0}
ONLY_OFFSET = dict.fromkeys(PARAMETERS, 0.5) | {"offset_mm": 1.0}


@pytest.fixture(scope="module")
def surrogate() -> WideSurrogate:
    """Of presses whose contrast is the far field's strength, and nothing else but what their direction adds."""
    rng = np.random.default_rng(2)
    parameters = draw_wide_parameters(3200, rng, inclusions_a_skin=3)
    direction_rad = rng.uniform(0, 2 * np.pi, 3200)
    with pytest.MonkeyPatch.context() as patch:  # a third of the terms is enough here
        patch.setattr(train_range, "REACH", FEW_TERMS)
        patch.setattr(fit_surrogate, "TURNED_REACH", ONLY_OFFSET)
        return wide_surrogate(PressSamples(parameters, far_rows(parameters, direction_rad), direction_rad))


def far_rows(parameters: np.ndarray, direction_rad: np.ndarray) -> np.ndarray:
    """Return rows whose contrast grows by a tenth along the image's rows, falls by as much across them, 2 mm aside.

    On the axis it does neither, and between as the offset.
    """
    rows = np.zeros((len(parameters), COLUMNS))
    size_mm, depth_mm = parameters[:, 0], parameters[:, 1]
    strength = (size_mm / (depth_mm + size_mm / 2)) ** 3
    rows[:, :44] = (strength * (1 + 0.05 * parameters[:, -1] * np.cos(2 * direction_rad)))[:, None]
    return rows


def test_polynomials_follow_what_is_one_around_the_ranges_as_well(surrogate):
    rng = np.random.default_rng(3)
    apart, direction_rad = draw_wide_parameters(200, rng), rng.uniform(0, 2 * np.pi, 200)
    assert is_outside(normalise(apart)).any()
    np.testing.assert_allclose(surrogate.rows(apart, direction_rad), far_rows(apart, direction_rad), atol=1e-6)


def test_a_press_set_keeps_coordinates_outside_and_is_drawn_anew_by_another_seed(surrogate):
    first, other = (wide_press_set(surrogate, white_noise(STD), 300, seed) for seed in (1, 2))
    assert 0.3 < is_outside(first.normalised).mean() < 0.7
    np.testing.assert_allclose(first.rows[:, :44].std(axis=1), 0, atol=1e-5)
    assert (first.normalised != other.normalised).all()
    assert len(np.unique(first.direction_rad)) == len(first.rows)
    assert (first.direction_rad != other.direction_rad).all()


def test_rows_of_a_press_set_are_those_of_its_directions_also_across_blocks(surrogate, monkeypatch):
    monkeypatch.setattr(train_range, "BLOCK", 7)
    found = wide_press_set(surrogate, white_noise(STD), 20, 1)
    expected = far_rows(denormalise(found.normalised.astype(float)), found.direction_rad)
    np.testing.assert_allclose(found.rows, expected, atol=1e-5 * np.abs(expected).max())
