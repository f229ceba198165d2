"""Both methods are judged by the same rules, and every kind of failure is counted."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from host_tools.paper_network.scaled_conjugate_gradient import Minimum, SearchStatus
from host_tools.paper_network.train import Trial
from host_tools.replication.networks import OURS, PLAIN, Recipe, Scenes, TrainingProblem
from host_tools.replication.side_by_side import Runs, constant_percent, side_by_side, to_the_end

TRUTH = np.array([[10.0, 5.0, 100.0], [20.0, 10.0, 50.0]])


def trial(value: float, status: SearchStatus = "stopped", parameter: float = 0.0) -> Trial:
    x = np.full(99, parameter)
    return Trial(x, Minimum(x, value, 7, status, ""))


def runs(factors: Sequence[float], trials: Sequence[Trial]) -> Runs:
    """Networks that answer with the truth times a factor each, against a guess that is 30 % off."""
    answers = np.array([factor * TRUTH for factor in factors])
    return Runs(TRUTH, answers, tuple(trials), 1.0, np.full(3, 30.0))


@pytest.fixture
def scenes() -> Scenes:
    rng = np.random.default_rng(4)
    truth = rng.uniform((3.0, 4.0, 40.0), (15.0, 12.0, 120.0), (70, 3))
    return Scenes(truth * [0.01, 1.0, 1.0], truth)


def test_errors_are_of_each_network_and_of_their_mean() -> None:
    found = runs([1.1, 0.9], [trial(1.0), trial(1.0)])
    assert found.percent == pytest.approx(10.0)
    assert found.averaged_percent == pytest.approx(0.0, abs=1e-9)
    assert (found.iterations, found.milliseconds) == (7, 500.0)


def test_failures_are_counted_by_kind() -> None:
    found = runs(
        [1.1, 1.4, np.nan, 1.0],
        [trial(1.0), trial(3.0, "max_iterations"), trial(np.nan), trial(1.5, parameter=np.inf)],
    )
    assert (found.not_finite(), found.used_up(), found.poor(1.0)) == (2, 1, 2)
    assert found.worse_than_a_constant().tolist() == [2, 2, 2]


def test_a_constant_guess_is_the_mean_of_the_scenes_that_train() -> None:
    """Mean (15, 7.5, 75): off by 50 and 25 %, 50 and 25 %, 25 and 50 %."""
    scenes = Scenes(TRUTH, TRUTH)
    assert constant_percent(scenes, scenes) == pytest.approx(37.5)


@pytest.mark.parametrize("recipe", [PLAIN, OURS])
def test_both_methods_learn_what_the_features_give_away(scenes: Scenes, recipe: Recipe) -> None:
    found = side_by_side(scenes.without(np.arange(9)), Scenes(scenes.features[:9], scenes.truth[:9]), recipe, seeds=2)
    assert list(found) == ["SCG", "LM"]
    for method in found.values():
        assert (method.averaged_percent < 5.0).all()
        assert method.worse_than_a_constant().tolist() == [0, 0, 0]
        assert method.seconds > 0


def test_to_the_end_no_scene_is_held_out_and_the_loss_is_of_all(scenes: Scenes) -> None:
    found = to_the_end(scenes, scenes, PLAIN, seeds=2)
    problem = TrainingProblem(scenes, PLAIN)
    for method in found.values():
        residual = problem.box.targets(method.answers[0]) - problem.targets
        assert method.losses[0] == pytest.approx(PLAIN.loss.value(residual), rel=1e-9)
        assert method.losses.max() < 1e-3


def test_the_same_number_trains_the_same_network(scenes: Scenes) -> None:
    problem = TrainingProblem(scenes, PLAIN)
    first, again, other = (problem.trial(1, number).parameters for number in (0, 0, 1))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
