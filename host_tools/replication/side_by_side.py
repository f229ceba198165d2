"""Scaled conjugate gradient and Levenberg-Marquardt from the same seeds: error, failures and time.

Both get the same start, the same scenes and the same loss; only the search differs. Time is a ratio of sums over runs
that took turns, since a machine's speed changes while it works.
Source: Lee & Won, IEEE JBHI 17(2), 2013, conclusion (SCG "fails to find the final optimal solution of ANN in some
cases"; they propose Levenberg-Marquardt).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from host_tools.paper_network.evaluate import relative_errors
from host_tools.paper_network.network import initial_parameters
from host_tools.paper_network.train import LM, SCG, Method, Trial
from host_tools.replication.networks import Recipe, Scenes, TrainingProblem

METHODS = {"SCG": SCG, "LM": LM}
POOR_RATIO = 2.0
"""A search that ends this many times as high as the best has not found what there is to find."""


@dataclass(frozen=True, eq=False)
class Runs:
    """One method from many seeds: its trials, and their answers [seeds, 9, 3] to the phantoms of truth [9, 3].

    `constant_percent` [3] is the error of answering the mean of the training scenes.
    """

    truth: Array
    answers: Array
    trials: tuple[Trial, ...]
    seconds: float
    constant_percent: Array

    @property
    def percent(self) -> Array:
        """Mean relative error over the phantoms of every seed's network, in percent [seeds, 3]."""
        return np.array([mean_percent(self.truth, answer) for answer in self.answers])

    @property
    def averaged_percent(self) -> Array:
        """Mean relative error over the phantoms of the mean of all networks, in percent [3]."""
        return mean_percent(self.truth, self.answers.mean(axis=0))

    @property
    def iterations(self) -> float:
        """Median number of iterations, rejected steps included."""
        return float(np.median([trial.minimum.iterations for trial in self.trials]))

    @property
    def losses(self) -> Array:
        """Loss of the rows that trained where each search ended [seeds]."""
        return np.array([trial.minimum.value for trial in self.trials])

    @property
    def milliseconds(self) -> float:
        """Time of one network on the machine that ran it."""
        return 1e3 * self.seconds / len(self.trials)

    def not_finite(self) -> int:
        """Count the networks whose parameters or answers are no numbers."""
        return sum(
            not (np.isfinite(trial.parameters).all() and np.isfinite(answer).all())
            for trial, answer in zip(self.trials, self.answers, strict=True)
        )

    def used_up(self) -> int:
        """Count the searches that neither converged nor were stopped before their allowance was used up."""
        return sum(trial.minimum.status == "max_iterations" for trial in self.trials)

    def worse_than_a_constant(self) -> Array:
        """Count, for each unknown [3], the networks that do no better than a constant guess, or give no number."""
        return np.asarray(np.sum(~(self.percent < self.constant_percent), axis=0))

    def poor(self, best: float) -> int:
        """Count the searches that end `POOR_RATIO` times as high as a loss of `best`."""
        return int(np.sum(~(self.losses <= POOR_RATIO * best)))


def mean_percent(truth: Array, estimate: Array) -> Array:
    """Return the mean relative error [3] of estimates [n, 3] in percent."""
    return np.asarray(100.0 * relative_errors(truth, estimate).mean(axis=0))


def constant_percent(scenes: Scenes, phantoms: Scenes) -> Array:
    """Return the mean relative error [3] in percent of answering the mean of the training scenes to everything."""
    return mean_percent(phantoms.truth, np.broadcast_to(scenes.truth.mean(axis=0), phantoms.truth.shape))


def side_by_side(scenes: Scenes, phantoms: Scenes, recipe: Recipe, *, seeds: int) -> dict[str, Runs]:
    """Return both methods' runs with early stopping, trained on `scenes` and asked about `phantoms`."""
    problem = TrainingProblem(scenes, recipe)
    return _take_turns(problem, phantoms, seeds, lambda method, seed: problem.trial(1, seed, method))


def to_the_end(scenes: Scenes, phantoms: Scenes, recipe: Recipe, *, seeds: int) -> dict[str, Runs]:
    """Return both methods' runs when nothing stops them but their allowance of iterations; all scenes train."""
    problem = TrainingProblem(scenes, recipe)

    def run(method: Method, seed: int) -> Trial:
        start = initial_parameters(np.random.default_rng([1, seed]))
        minimum = method.search(problem.inputs, problem.targets, recipe.loss, start, None)
        return Trial(minimum.x, minimum)

    return _take_turns(problem, phantoms, seeds, run)


def _take_turns(
    problem: TrainingProblem, phantoms: Scenes, seeds: int, run: Callable[[Method, int], Trial]
) -> dict[str, Runs]:
    trials: dict[str, list[Trial]] = {name: [] for name in METHODS}
    seconds = dict.fromkeys(METHODS, 0.0)
    for seed in range(seeds):
        for name, method in METHODS.items():
            began = time.perf_counter()
            trials[name].append(run(method, seed))
            seconds[name] += time.perf_counter() - began
    guess = constant_percent(problem.scenes, phantoms)
    found = {}
    for name, made in trials.items():
        answers = problem.answers(np.array([trial.parameters for trial in made]), phantoms.features)
        found[name] = Runs(phantoms.truth, answers, tuple(made), seconds[name], guess)
    return found
