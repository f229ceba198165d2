"""Training scenes to sets of networks, trained as the paper's words allow or as this project trains them.

The paper gives layers, algorithm and number of trials. How features enter, what is minimised and when training stops
it does not say: a `Recipe` chooses. The networks of a set are kept apart, since the paper averages a hundred of them
and a single one is what a user would have trained.
Source: Lee & Won, IEEE JBHI 17(2), 2013, sections II and IV-A.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from device.measurement.arrays import Array
from host_tools.paper_network.network import MEAN_SQUARE, MISFIT, Loss, Scaling, forward
from host_tools.paper_network.train import SCG, Method, Trial, run_trial
from host_tools.workers import one_core_each

WORTH_SHARING = 20
"""Trials from which other processes, which take seconds to start, are worth it."""
Inputs = Callable[[Array], Array]
"""Features [n, 3] in mm, mm3, mm2 to network inputs [n, 3]."""


class Recipe(NamedTuple):
    """What the paper leaves open: how the training features decide the inputs, and what is minimised."""

    name: str
    inputs: Callable[[Array], Inputs]
    loss: Loss


def standardised(features: Array) -> Inputs:
    """Return the inputs that have mean 0 and standard deviation 1 over the training features [n, 3], and no more."""
    mean, std = features.mean(axis=0), features.std(axis=0)
    return lambda rows: np.asarray((rows - mean) / std)


def logarithms(features: Array) -> Inputs:
    """Return this project's inputs: standardised logarithms above a floor."""
    return Scaling.fit(features).inputs


PLAIN = Recipe("features, mean square", standardised, MEAN_SQUARE)
LOGARITHMS = Recipe("logarithms of features, mean square", logarithms, MEAN_SQUARE)
MISFITS = Recipe("features, sum of logarithms", standardised, MISFIT)
OURS = Recipe("logarithms of features, sum of logarithms (this project)", logarithms, MISFIT)
RECIPES = (PLAIN, LOGARITHMS, MISFITS, OURS)


@dataclass(frozen=True, eq=False)
class Scenes:
    """Scenes as deformation features [n, 3] (mm, mm3, mm2) and truths [n, 3] (mm, mm, kPa)."""

    features: Array
    truth: Array

    def without(self, rows: NDArray[np.int64] | int) -> Scenes:
        """Return the other scenes."""
        return Scenes(np.delete(self.features, rows, axis=0), np.delete(self.truth, rows, axis=0))


class TrainingProblem:
    """Scenes scaled by a recipe, ready to be trained on."""

    def __init__(self, scenes: Scenes, recipe: Recipe) -> None:
        self.scenes, self.recipe = scenes, recipe
        self.box, self.inputs_of = Scaling.fit(scenes.features), recipe.inputs(scenes.features)
        self.inputs, self.targets = self.inputs_of(scenes.features), self.box.targets(scenes.truth)

    def trial(self, seed: int, number: int, method: Method = SCG) -> Trial:
        """Train one network; seed and number give start and held-out fifth, as in `host_tools train`."""
        rng = np.random.default_rng([seed, number])
        return run_trial(self.inputs, self.targets, rng, method=method, loss=self.recipe.loss)

    def answers(self, parameters: Array, features: Array) -> Array:
        """Return what each network of parameters [trials, 99] answers to features [n, 3]: [trials, n, 3]."""
        return self.box.unknowns(forward(parameters, self.inputs_of(features)))


class Networks:
    """`trials` networks trained by scaled conjugate gradient on the same scenes."""

    def __init__(self, scenes: Scenes, recipe: Recipe, *, trials: int, seed: int = 1) -> None:
        self.problem = TrainingProblem(scenes, recipe)
        with one_core_each():
            found = Parallel(n_jobs=-1 if trials >= WORTH_SHARING else 1)(
                delayed(self.problem.trial)(seed, number) for number in range(trials)
            )
        self.parameters = np.array([trial.parameters for trial in found])

    def answers(self, features: Array) -> Array:
        """Return every network's answer [trials, n, 3] to features [n, 3]."""
        return self.problem.answers(self.parameters, features)
