"""Training: what it learns, what it must not see, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from host_tools.paper_network import train as training
from host_tools.paper_network.evaluate import relative_errors
from host_tools.paper_network.network import Loss, Scaling, forward
from host_tools.paper_network.scaled_conjugate_gradient import Minimum, Stop
from host_tools.paper_network.train import LM, Method, TrainingRows, run_trial, train


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training, "MAX_ITERATIONS", 20)


def test_all_three_unknowns_are_found_when_the_features_determine_them(rows: TrainingRows) -> None:
    """The features can be inverted on paper, so phantoms that never trained must come out within a few percent."""
    trained = train(rows, trials=3, jobs=1)
    phantoms = rows.phantom_index
    errors = relative_errors(rows.truth[phantoms], trained.ensemble.estimate(rows.features[phantoms]).estimate)
    assert np.all(errors.mean(axis=0) < 0.03)


def test_the_seed_alone_fixes_the_networks_whatever_the_jobs(rows: TrainingRows) -> None:
    alone, shared = (train(rows, trials=2, seed=4, jobs=jobs).ensemble.parameters for jobs in (1, 2))
    assert np.array_equal(alone, shared)


@pytest.mark.usefixtures("short")
def test_another_seed_gives_other_networks(rows: TrainingRows) -> None:
    first, second = (train(rows, trials=2, seed=seed, jobs=1).ensemble.parameters for seed in (1, 2))
    assert not np.any(np.all(first == second, axis=1))
    assert not np.array_equal(first[0], first[1])


@pytest.mark.usefixtures("short")
def test_phantoms_never_train(rows: TrainingRows) -> None:
    """Other phantoms, same networks: neither weights nor scaling may have seen them."""
    features, truth = rows.features.copy(), rows.truth.copy()
    features[rows.phantom_index] *= 3.0
    truth[rows.phantom_index] = 50.0
    first = train(rows, trials=2, jobs=1).ensemble
    second = train(replace(rows, features=features, truth=truth), trials=2, jobs=1).ensemble
    assert np.array_equal(first.parameters, second.parameters)
    assert np.array_equal(first.scaling.log_mean, second.scaling.log_mean)


@pytest.mark.usefixtures("short")
def test_progress_is_told_after_each_trial(rows: TrainingRows) -> None:
    told: list[tuple[int, int]] = []
    train(rows, trials=3, jobs=1, progress=lambda done, total: told.append((done, total)))
    assert told == [(1, 3), (2, 3), (3, 3)]


def test_early_stopping_keeps_the_best_and_stops_when_no_better_follows() -> None:
    """Networks of output biases b only answer b, so against targets 0 the misfit rises with |b|: 0.1 is the best."""
    tried = [np.r_[np.zeros(96), np.full(3, bias)] for bias in (0.5, 0.1, 0.2, 0.3)]
    keep_best = training._KeepBest(np.zeros((2, 3)), np.zeros((2, 3)), np.zeros(99), patience=2)
    assert [bool(keep_best(parameters)) for parameters in tried] == [False, False, False, True]
    assert np.array_equal(keep_best.parameters, tried[1])


def test_levenberg_marquardt_finds_all_three_unknowns_too(rows: TrainingRows) -> None:
    """One network on features that can be inverted on paper, answering for scenes that it never saw."""
    seen, unseen = rows.training_index, rows.phantom_index
    scaling = Scaling.fit(rows.features[seen])
    inputs, targets = scaling.inputs(rows.features[seen]), scaling.targets(rows.truth[seen])
    trial = run_trial(inputs, targets, np.random.default_rng(1), method=LM)
    answers = scaling.unknowns(forward(trial.parameters, scaling.inputs(rows.features[unseen])))
    assert np.all(relative_errors(rows.truth[unseen], answers).mean(axis=0) < 0.03)


def test_two_methods_of_one_seed_begin_alike_with_the_same_scenes(rows: TrainingRows) -> None:
    asked: list[tuple[Array, Array, Array]] = []

    def search(inputs: Array, targets: Array, loss: Loss, start: Array, stop: Stop | None) -> Minimum:
        asked.append((inputs, targets, start))
        return Minimum(start, 0.0, 0, "stopped", "at once")

    for patience in (1, 2):
        run_trial(rows.features, rows.truth, np.random.default_rng(5), method=Method(search, patience))
    first, second = asked
    assert all(np.array_equal(one, other) for one, other in zip(first, second, strict=True))
    assert len(first[0]) == round(0.8 * len(rows.features))


def test_too_few_rows_are_refused(rows: TrainingRows) -> None:
    few = replace(rows, features=rows.features[:60], truth=rows.truth[:60], phantom_index=np.arange(9))
    with pytest.raises(InvalidQuantity, match="training rows is 51, but must be at least 60"):
        train(few, trials=2)


def test_too_few_phantoms_are_refused(rows: TrainingRows) -> None:
    with pytest.raises(InvalidQuantity, match="phantom rows is 1, but must be at least 2"):
        train(replace(rows, phantom_index=np.array([3])), trials=2)


def test_a_phantom_index_past_the_rows_is_refused(rows: TrainingRows) -> None:
    with pytest.raises(InvalidQuantity, match="phantom_index is 134"):
        train(replace(rows, phantom_index=np.array([0, 134])), trials=2)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_feature_that_is_not_finite_is_refused_by_name_and_row(rows: TrainingRows, value: float) -> None:
    features = rows.features.copy()
    features[17, 1] = value
    with pytest.raises(InvalidQuantity, match=f"central_deformation_mm3 of row 17 is {value}"):
        train(replace(rows, features=features), trials=2)


def test_a_truth_that_is_not_finite_is_refused_by_name_and_row(rows: TrainingRows) -> None:
    truth = rows.truth.copy()
    truth[5, 2] = np.nan
    with pytest.raises(InvalidQuantity, match="youngs_modulus_kpa of row 5 is nan"):
        train(replace(rows, truth=truth), trials=2)


def test_another_number_of_features_is_refused(rows: TrainingRows) -> None:
    with pytest.raises(InvalidQuantity, match=r"shape of features is \[134, 2\]"):
        train(replace(rows, features=rows.features[:, :2]), trials=2)


def test_features_of_another_name_or_order_are_refused(rows: TrainingRows) -> None:
    with pytest.raises(InvalidQuantity, match="feature_names is deformation_area_mm2"):
        train(replace(rows, feature_names=rows.feature_names[::-1]), trials=2)


def test_one_trial_is_refused(rows: TrainingRows) -> None:
    with pytest.raises(InvalidQuantity, match="trials is 1, but must be at least 2"):
        train(rows, trials=1)
