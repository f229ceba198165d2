"""Turns rows of a data set (features and truths) into an ensemble of inverse networks.

The phantom rows never train. Each trial has its own initial weights and its own held-out fifth of the training rows,
on which it keeps its best parameters; the trials therefore also differ in what they have seen.
Source: Lee & Won, IEEE JBHI 17(2), 2013, section IV-A (125 rows train, nine validate, 100 trials averaged).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.paper_mode.estimate import PAPER_UNITS
from device.measurement.quantities import UNKNOWNS, Bound, InvalidQuantity, require
from host_tools.paper_network import levenberg_marquardt, scaled_conjugate_gradient
from host_tools.paper_network.network import (
    MISFIT,
    PARAMETER_COUNT,
    Ensemble,
    Loss,
    NetworkResiduals,
    Scaling,
    forward,
    initial_parameters,
    loss_and_gradient,
)
from host_tools.paper_network.scaled_conjugate_gradient import Minimum, Stop
from host_tools.workers import one_core_each

MIN_TRAINING_ROWS = 60
HELD_OUT_RATIO = 0.2
MAX_ITERATIONS = 1000
"""Five times as many change the held-out errors of finite-element features by less than 0.05 percentage points."""
PATIENCE = 200
"""Accepted steps without a better held-out loss after which a trial ends."""
LM_MAX_ITERATIONS, LM_PATIENCE = 500, 50
"""The same for Levenberg-Marquardt, whose steps are fewer and go further; a patience of 200 changes the held-out errors
of size and depth by less than 0.1 percentage points."""

Progress = Callable[[int, int], None]
"""Called with (trials done, trials in all)."""


@dataclass(frozen=True, eq=False)
class TrainingRows:
    """Scenes as features and truths, all in one order.

    features: [n, 3] in mm, mm3, mm2 in the order of `feature_names`; truth: [n, 3] in the order of `UNKNOWNS`;
    phantom_index: the rows kept apart for validation; excluded_rows: scenes that failed and are not among the n.
    """

    feature_names: tuple[str, ...]
    features: Array
    truth: Array
    phantom_index: NDArray[np.int64]
    dataset_sha256: str
    scene_defaults: dict[str, Any]
    excluded_rows: int

    @property
    def training_index(self) -> NDArray[np.int64]:
        """All rows that are no phantom."""
        return np.setdiff1d(np.arange(len(self.features)), self.phantom_index)


@dataclass(frozen=True, eq=False)
class Trained:
    """An ensemble, and what it takes to make it again."""

    ensemble: Ensemble
    rows: TrainingRows
    seed: int

    @property
    def trials(self) -> int:
        """Number of networks."""
        return len(self.ensemble.parameters)


def train(
    rows: TrainingRows, *, trials: int = 100, seed: int = 1, progress: Progress | None = None, jobs: int = -1
) -> Trained:
    """Return the ensemble of `trials` networks; the same seed gives the same one whatever `jobs` (-1: all cores).

    Raises `InvalidQuantity` for fewer than two trials, fewer than 60 training rows or two phantoms, features other
    than the paper's three, and any number that is not finite.
    """
    require_usable(rows)
    require_trials(trials)
    features, truth = rows.features[rows.training_index], rows.truth[rows.training_index]
    scaling = Scaling.fit(features)
    inputs, targets = scaling.inputs(features), scaling.targets(truth)
    parameters = np.empty((trials, PARAMETER_COUNT))
    with one_core_each():
        running = Parallel(n_jobs=jobs, return_as="generator")(
            delayed(train_one)(inputs, targets, np.random.default_rng([seed, trial])) for trial in range(trials)
        )
        for trial, found in enumerate(running):
            parameters[trial] = found
            if progress:
                progress(trial + 1, trials)
    return Trained(Ensemble(scaling, parameters), rows, seed)


class Method(NamedTuple):
    """A way to search from parameters [99] for the least loss of scaled rows [n, 3], and how long it may find none."""

    search: Callable[[Array, Array, Loss, Array, Stop | None], Minimum]
    patience: int


def by_scaled_conjugate_gradient(inputs: Array, targets: Array, loss: Loss, start: Array, stop: Stop | None) -> Minimum:
    """Return where scaled conjugate gradients end."""
    return scaled_conjugate_gradient.minimise(
        lambda parameters: loss_and_gradient(parameters, inputs, targets, loss),
        start,
        max_iterations=MAX_ITERATIONS,
        stop=stop,
    )


def by_levenberg_marquardt(inputs: Array, targets: Array, loss: Loss, start: Array, stop: Stop | None) -> Minimum:
    """Return where Levenberg-Marquardt ends."""
    problem = NetworkResiduals(inputs, targets, loss)
    return levenberg_marquardt.minimise(problem, start, max_iterations=LM_MAX_ITERATIONS, stop=stop)


SCG = Method(by_scaled_conjugate_gradient, PATIENCE)
LM = Method(by_levenberg_marquardt, LM_PATIENCE)


class Trial(NamedTuple):
    """The parameters [99] that a trial keeps, and where and why its search ended."""

    parameters: Array
    minimum: Minimum


def train_one(inputs: Array, targets: Array, rng: np.random.Generator) -> Array:
    """Return the parameters [99] that do best on this trial's held-out fifth of the scaled rows [n, 3]."""
    return run_trial(inputs, targets, rng).parameters


def run_trial(
    inputs: Array, targets: Array, rng: np.random.Generator, *, method: Method = SCG, loss: Loss = MISFIT
) -> Trial:
    """Train one network on four fifths of the scaled rows [n, 3]; keep what does best on the held-out fifth.

    Start and split come from `rng` alone, so that two methods given the same seed begin alike.
    """
    shuffled = rng.permutation(len(inputs))
    held_out, fitted = np.split(shuffled, [round(HELD_OUT_RATIO * len(inputs))])
    start = initial_parameters(rng)
    keep_best = _KeepBest(inputs[held_out], targets[held_out], start, loss=loss, patience=method.patience)
    minimum = method.search(inputs[fitted], targets[fitted], loss, start, keep_best)
    return Trial(keep_best.parameters, minimum)


class _KeepBest:
    """Early stopping: remembers the parameters with the least held-out loss, and asks to stop when none follows."""

    def __init__(
        self, inputs: Array, targets: Array, start: Array, *, loss: Loss = MISFIT, patience: int = PATIENCE
    ) -> None:
        self.inputs, self.targets, self.loss, self.patience = inputs, targets, loss, patience
        self.parameters, self.least, self.steps_since = start, np.inf, 0

    def __call__(self, parameters: Array) -> str:
        value = self.loss.value(forward(parameters, self.inputs) - self.targets)
        self.steps_since += 1
        if value < self.least:
            self.parameters, self.least, self.steps_since = parameters, value, 0
        return f"no better held-out loss in {self.patience} steps" if self.steps_since >= self.patience else ""


def require_trials(trials: int) -> None:
    """Raise `InvalidQuantity` for too few or too many networks."""
    require("trials", trials, Bound(2, 10_000, "networks"), "train at least two, for a spread")


def require_usable(rows: TrainingRows) -> None:
    """Raise `InvalidQuantity` naming what keeps rows from training; see `train`."""
    names = tuple(PAPER_UNITS)
    if rows.feature_names != names:
        action = "make the data set with this version of the toolkit"
        raise InvalidQuantity("feature_names", ", ".join(rows.feature_names), f"the three {', '.join(names)}", action)
    for quantity, table, columns in (("features", rows.features, names), ("truth", rows.truth, UNKNOWNS)):
        if table.shape != (len(rows.features), len(columns)):
            bound = f"[{len(rows.features)}, {len(columns)}]"
            raise InvalidQuantity(f"shape of {quantity}", list(table.shape), bound, "give one row a scene")
        for row, column in np.argwhere(~np.isfinite(table)):
            name = f"{columns[column]} of row {row}"
            raise InvalidQuantity(name, table[row, column], "a finite number", "exclude the scene from the rows")
    action = "sweep more scenes"
    require("training rows", len(rows.training_index), Bound(MIN_TRAINING_ROWS, np.inf, "rows"), action)
    require("phantom rows", len(np.unique(rows.phantom_index)), Bound(2, np.inf, "rows"), action)
    for index in rows.phantom_index:
        require("phantom_index", int(index), Bound(0, len(rows.features) - 1, ""), "name rows of this data set")
