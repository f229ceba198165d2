"""An exported ensemble with fewer members, and in integers."""

from __future__ import annotations

import numpy as np
import pytest

from device.measurement.bundle import open_session
from host_tools.press_models.dense_network import InputScaling, initial_layers
from host_tools.press_models.onnx_networks import build_network, physical_estimate
from host_tools.press_models.train_ensemble import DenseEnsemble
from host_tools.tradeoff.press_networks import in_integers, members_of, with_members

COLUMNS, DIRECTIONS = 40, 8


@pytest.fixture(scope="module")
def ensemble() -> DenseEnsemble:
    rng = np.random.default_rng(3)
    scaling = InputScaling.fit(rng.normal(size=(200, COLUMNS)), np.eye(COLUMNS), DIRECTIONS)
    return DenseEnsemble(scaling, tuple(initial_layers(2 * DIRECTIONS, rng, hidden=12) for _ in range(3)))


def answers(network: bytes, rows: np.ndarray) -> np.ndarray:
    (found,) = open_session(network).run(["estimate"], {"features": rows.astype(np.float32)})
    return np.asarray(found)


def test_fewer_members_are_the_first_ones(ensemble: DenseEnsemble) -> None:
    rows = np.random.default_rng(4).normal(size=(5, COLUMNS))
    network = build_network(ensemble)
    assert members_of(network) == 3
    two = with_members(network, 2)
    assert members_of(two) == 2
    expected, _ = physical_estimate(DenseEnsemble(ensemble.scaling, ensemble.members[:2]), rows)
    assert answers(two, rows) == pytest.approx(expected, rel=1e-4)


def test_integers_answer_nearly_the_same(ensemble: DenseEnsemble) -> None:
    rows = np.random.default_rng(4).normal(size=(20, COLUMNS))
    network = build_network(ensemble)
    exact, rounded = answers(network, rows), answers(in_integers(network), rows)
    spread = exact.std(axis=0)
    assert (np.abs(rounded - exact).max(axis=0) < 0.3 * spread).all()
    assert not np.array_equal(rounded, exact)
