"""Random presses to an ensemble of networks, whose mean is the standard mode's estimate.

Members differ in their first weights and in the presses they see. The ensemble's variance is the mean of the members'
variances plus the variance of their means. Source: Lakshminarayanan et al., NeurIPS 2017.

They learn by Adam, stochastic gradient descent with a step of its own for every weight, under a cosine schedule: it is
for networks of ten thousand weights on endless random presses; the paper's 99 weights learn by SCG.
Sources: Kingma & Ba, ICLR 2015, algorithm 1; Loshchilov & Hutter, ICLR 2017, on the schedule.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array, Single
from device.measurement.quantities import UNKNOWNS, Bound, require
from host_tools.press_models.dense_network import (
    HIDDEN,
    DenseLayer,
    InputScaling,
    initial_layers,
    loss_and_gradient,
    predict,
)
from host_tools.press_models.noisy_presses import Presses
from host_tools.workers import one_core_each

DECAY_MEAN, DECAY_SQUARE, TINY = 0.9, 0.999, np.float32(1e-8)
BATCH, RATE = 1024, 3e-3
SCALED_ON = 20_000
"""Rows of which the scaling of the inputs is taken."""
FEWEST_PRESSES = 1000


class Adam:
    """Holds the moments of the gradient of each layer, and changes the layers in place."""

    def __init__(self, layers: list[DenseLayer], *, rate: float, steps: int) -> None:
        """The rate falls from `rate` to nothing over `steps`."""
        self._parts = [part for layer in layers for part in layer]
        self._mean = [np.zeros_like(part) for part in self._parts]
        self._square = [np.zeros_like(part) for part in self._parts]
        self._rate, self._steps, self._done = rate, steps, 0

    def step(self, gradient: list[DenseLayer]) -> None:
        """Move all weights against a gradient."""
        self._done += 1
        rate = 0.5 * self._rate * (1 + np.cos(np.pi * min(self._done / self._steps, 1.0)))
        rate *= np.sqrt(1 - DECAY_SQUARE**self._done) / (1 - DECAY_MEAN**self._done)
        slopes: list[Single] = [part for layer in gradient for part in layer]
        for part, slope, mean, square in zip(self._parts, slopes, self._mean, self._square, strict=True):
            mean += np.float32(1 - DECAY_MEAN) * (slope - mean)
            square += np.float32(1 - DECAY_SQUARE) * (slope * slope - square)
            part -= np.float32(rate) * mean / (np.sqrt(square) + TINY)


class Task(NamedTuple):
    """What networks are to learn of a training set's presses: `target` [n, ...], by a loss of so many outputs."""

    outputs: int
    target: Single
    loss_and_gradient: Callable[[list[DenseLayer], Single, Single], tuple[float, list[DenseLayer]]]


@dataclass(frozen=True, eq=False)
class DenseEnsemble:
    """Networks that share one scaling of the inputs."""

    scaling: InputScaling
    members: tuple[list[DenseLayer], ...]

    def estimate(self, rows: Array) -> tuple[Array, Array]:
        """Return mean and spread [n, 3] of the coordinates of the unknowns, for rows [n, P]."""
        inputs = self.scaling.inputs(rows.astype(np.float32))
        predictions = [predict(layers, inputs) for layers in self.members]
        means = np.array([prediction.mean for prediction in predictions], dtype=np.float64)
        variances = np.exp(np.array([prediction.log_variance for prediction in predictions], dtype=np.float64))
        return means.mean(axis=0), np.sqrt(variances.mean(axis=0) + means.var(axis=0))


def train_ensemble(
    training_set: Presses,
    *,
    seed: int,
    members: int,
    steps: int,
    columns: slice = slice(None),
    hidden: int = HIDDEN,
    jobs: int = -1,
) -> DenseEnsemble:
    """Return the ensemble trained on a training set's rows, or on some of their columns, its hidden layers so wide.

    The same seed gives the same ensemble whatever `jobs` (-1: all cores). Raises `InvalidQuantity` for too few presses.
    """
    task = Task(2 * len(UNKNOWNS), training_set.normalised[:, : len(UNKNOWNS)], loss_and_gradient)
    budget = {"members": members, "steps": steps, "hidden": hidden}
    return DenseEnsemble(*train_members(training_set, task, seed=seed, columns=columns, jobs=jobs, **budget))


def train_members(
    training_set: Presses,
    task: Task,
    *,
    seed: int,
    members: int,
    steps: int,
    columns: slice = slice(None),
    hidden: int = HIDDEN,
    jobs: int = -1,
) -> tuple[InputScaling, tuple[list[DenseLayer], ...]]:
    """Return the scaling that networks share and the layers of each, trained on a task; as `train_ensemble`."""
    presses = len(training_set.normalised)  # not of the rows: a set may make these anew whenever it is asked
    require("presses", presses, Bound(FEWEST_PRESSES, np.inf, "presses"), "draw more random presses")
    require("members", members, Bound(1, 100, "networks"), "train at least one")
    rng = np.random.default_rng([seed, 0])
    some = training_set.noisy(rng.integers(presses, size=min(SCALED_ON, presses)), rng)
    typical = training_set.typical_noise()[columns, columns]
    scaling = InputScaling.fit(some[:, columns].astype(np.float64), typical)
    with one_core_each():
        trained = Parallel(n_jobs=jobs)(
            delayed(_member)(
                training_set, task, scaling, np.random.default_rng([seed, 1 + member]), steps, columns, hidden
            )
            for member in range(members)
        )
    return scaling, tuple(trained)


def _member(
    training_set: Presses,
    task: Task,
    scaling: InputScaling,
    rng: np.random.Generator,
    steps: int,
    columns: slice,
    hidden: int,
) -> list[DenseLayer]:
    """Return the layers of one network after `steps` batches of fresh noise."""
    layers = initial_layers(2 * scaling.projection.shape[1], rng, task.outputs, hidden)
    adam = Adam(layers, rate=RATE, steps=steps)
    for _ in range(steps):
        index = rng.integers(len(training_set.normalised), size=BATCH)
        inputs = scaling.inputs(training_set.noisy(index, rng)[:, columns])
        adam.step(task.loss_and_gradient(layers, inputs, task.target[index])[1])
    return layers
