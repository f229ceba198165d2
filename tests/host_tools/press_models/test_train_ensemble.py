"""On rows that are linear in size and depth an ensemble learns both, and how well it knows them."""

import numpy as np
import pytest
from small_surrogate import linear_surrogate, white_noise

from device.measurement.parameters import PARAMETERS
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.radial_profile import RESPONSE
from device.measurement.ramp_modes.surrogate import DEPTH, MODULUS, RESPONSE_COLUMNS, SIZE
from host_tools.press_models.dense_network import initial_layers
from host_tools.press_models.noisy_presses import PressSet, random_press_set
from host_tools.press_models.train_ensemble import DenseEnsemble, train_ensemble

STD, COUNT, STEPS = 0.3, 20_000, 300
EVEN = 1 / np.sqrt(3)


@pytest.fixture(scope="module")
def press_set() -> PressSet:
    """Half of the columns see the size and half the depth: each is known to about 0.3 / sqrt(16)."""
    slopes = np.zeros((len(PARAMETERS), RESPONSE_COLUMNS))
    slopes[SIZE, ::2], slopes[DEPTH, 1::2] = 1.0, 1.0
    return random_press_set(linear_surrogate(slopes), white_noise(STD), COUNT, seed=1)


@pytest.fixture(scope="module")
def ensemble(press_set) -> DenseEnsemble:
    return train_ensemble(press_set, seed=1, members=2, steps=STEPS, columns=RESPONSE, jobs=1)


@pytest.fixture(scope="module")
def answers(press_set, ensemble) -> tuple[np.ndarray, np.ndarray]:
    """Error and spread [n, 3] on fresh noise."""
    index = np.arange(5000)
    mean, spread = ensemble.estimate(press_set.noisy(index, np.random.default_rng(9))[:, RESPONSE].astype(np.float64))
    return mean - press_set.normalised[index, :3], spread


def test_what_shows_is_learnt_almost_as_well_as_can_be(answers):
    error = np.sqrt(np.mean(answers[0] ** 2, axis=0))
    possible = STD / np.sqrt(RESPONSE_COLUMNS // 2)
    assert (error[[SIZE, DEPTH]] < 0.25 * EVEN).all()
    assert (error[[SIZE, DEPTH]] > 0.8 * possible).all()


def test_the_spread_is_as_large_as_the_error(answers):
    error, spread = (np.sqrt(np.mean(part**2, axis=0)) for part in answers)
    np.testing.assert_allclose(spread, error, rtol=0.3)


def test_what_does_not_show_keeps_the_spread_of_its_prior(answers):
    assert np.mean(answers[1][:, MODULUS]) == pytest.approx(EVEN, rel=0.15)


def test_an_ensembles_variance_is_that_of_its_members_and_of_their_means(press_set, ensemble):
    rows = press_set.rows[:5, RESPONSE].astype(np.float64)
    alone = [DenseEnsemble(ensemble.scaling, (member,)).estimate(rows) for member in ensemble.members]
    (first, first_spread), (second, second_spread) = alone
    mean, spread = ensemble.estimate(rows)
    np.testing.assert_allclose(mean, (first + second) / 2, atol=1e-6)
    expected = (first_spread**2 + second_spread**2) / 2 + (first - second) ** 2 / 4
    np.testing.assert_allclose(spread**2, expected, rtol=1e-4)
    assert np.abs(first - second).max() > 1e-3


def test_the_same_seed_gives_the_same_ensemble_and_the_members_differ(press_set):
    first, again = (train_ensemble(press_set, seed=3, members=2, steps=2, columns=RESPONSE, jobs=1) for _ in range(2))
    for one, other in zip(first.members, again.members, strict=True):
        np.testing.assert_array_equal(one[0].weights, other[0].weights)
    assert np.abs(first.members[0][0].weights - first.members[1][0].weights).max() > 0.01


class NoisyOnly:
    """Presses whose rows nobody may ask for: `NetworkPresses` makes all of them anew each time."""

    def __init__(self, of: PressSet) -> None:
        self.normalised, self.noisy, self.typical_noise = of.normalised, of.noisy, of.typical_noise


def test_a_step_makes_no_other_rows_than_its_own(press_set):
    sets = NoisyOnly(press_set), press_set
    found, expected = (train_ensemble(one, seed=3, members=1, steps=2, columns=RESPONSE, jobs=1) for one in sets)
    np.testing.assert_array_equal(found.members[0][0].weights, expected.members[0][0].weights)


def test_too_few_presses_or_no_network_are_refused_by_name(press_set):
    few = PressSet(press_set.normalised[:999], press_set.rows[:999], press_set.direction_rad[:999], press_set.sampler)
    with pytest.raises(InvalidQuantity, match="^presses is 999"):
        train_ensemble(few, seed=1, members=1, steps=1, jobs=1)
    with pytest.raises(InvalidQuantity, match="^members is 0"):
        train_ensemble(press_set, seed=1, members=0, steps=1, jobs=1)


def test_an_untrained_network_is_no_better_than_a_guess(press_set, ensemble):
    untrained = initial_layers(2 * ensemble.scaling.projection.shape[1], np.random.default_rng(1))
    mean, _ = DenseEnsemble(ensemble.scaling, (untrained,)).estimate(press_set.rows[:2000, RESPONSE].astype(np.float64))
    assert np.std(mean - press_set.normalised[:2000, :3], axis=0).min() > 0.8 * EVEN
