"""Turns rows of a data set (features and truths) into an ensemble of inverse networks.

The phantom rows never train. Each trial has its own initial weights and its own held-out fifth of the training rows,
on which it keeps its best parameters; the trials therefore also differ in what they have seen.
Source: Lee & Won, IEEE JBHI 17(2), 2013, section IV-A (125 rows train, nine validate, 100 trials averaged).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from joblib import Parallel, delayed, parallel_config
from numpy.typing import NDArray

from device.measurement.inversion import FEATURE_UNITS
from device.measurement.quantities import UNKNOWNS, Bound, InvalidQuantity, require
from host_tools.inverse.network import (
    PARAMETER_COUNT,
    Array,
    Ensemble,
    Scaling,
    forward,
    initial_parameters,
    loss_and_gradient,
    misfit,
)
from host_tools.inverse.scaled_conjugate_gradient import minimise

MIN_TRAINING_ROWS = 60
HELD_OUT_RATIO = 0.2
MAX_ITERATIONS = 1000
"""Five times as many change the held-out errors of finite-element features by less than 0.05 percentage points."""
PATIENCE = 200
"""Accepted steps without a better held-out misfit after which a trial ends."""

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
    _require_usable(rows)
    require("trials", trials, Bound(2, 10_000, "networks"), "train at least two, for a spread")
    features, truth = rows.features[rows.training_index], rows.truth[rows.training_index]
    scaling = Scaling.fit(features)
    inputs, targets = scaling.inputs(features), scaling.targets(truth)
    parameters = np.empty((trials, PARAMETER_COUNT))
    with parallel_config(backend="loky", inner_max_num_threads=1):
        running = Parallel(n_jobs=jobs, return_as="generator")(
            delayed(train_one)(inputs, targets, np.random.default_rng([seed, trial])) for trial in range(trials)
        )
        for trial, found in enumerate(running):
            parameters[trial] = found
            if progress:
                progress(trial + 1, trials)
    return Trained(Ensemble(scaling, parameters), rows, seed)


def train_one(inputs: Array, targets: Array, rng: np.random.Generator) -> Array:
    """Return the parameters [99] that do best on this trial's held-out fifth of the scaled rows [n, 3]."""
    shuffled = rng.permutation(len(inputs))
    held_out, fitted = np.split(shuffled, [round(HELD_OUT_RATIO * len(inputs))])
    start = initial_parameters(rng)
    keep_best = _KeepBest(inputs[held_out], targets[held_out], start)
    minimise(
        lambda parameters: loss_and_gradient(parameters, inputs[fitted], targets[fitted]),
        start,
        max_iterations=MAX_ITERATIONS,
        stop=keep_best,
    )
    return keep_best.parameters


class _KeepBest:
    """Early stopping: remembers the parameters with the least held-out misfit, and asks to stop when none follows."""

    def __init__(self, inputs: Array, targets: Array, start: Array) -> None:
        self.inputs, self.targets = inputs, targets
        self.parameters, self.misfit, self.steps_since = start, np.inf, 0

    def __call__(self, parameters: Array) -> str:
        value = misfit(forward(parameters, self.inputs) - self.targets)
        self.steps_since += 1
        if value < self.misfit:
            self.parameters, self.misfit, self.steps_since = parameters, value, 0
        return f"no better held-out misfit in {PATIENCE} steps" if self.steps_since >= PATIENCE else ""


def _require_usable(rows: TrainingRows) -> None:
    names = tuple(FEATURE_UNITS)
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
