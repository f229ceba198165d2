"""Synthetic scenes whose features determine all three unknowns, by formulas that can be inverted on paper."""

from __future__ import annotations

import numpy as np
import pytest

from host_tools.paper_network.network import Ensemble, Scaling, initial_parameters
from host_tools.paper_network.train import Trained, TrainingRows


def synthetic_rows(count: int = 134) -> TrainingRows:
    """O3 = 10 d gives d, O2/O1 = 3 h gives h, and O1 = 1e-3 d^2/h sqrt(E/80) then gives E."""
    rng = np.random.default_rng(7)
    truth = rng.uniform((3.0, 4.0, 40.0), (15.0, 12.0, 120.0), (count, 3))
    size, depth, modulus = truth.T
    peak = 1e-3 * size**2 / depth * np.sqrt(modulus / 80.0)
    features = np.column_stack([peak, 3.0 * depth * peak, 10.0 * size])
    return TrainingRows(
        feature_names=("max_deformation_mm", "central_deformation_mm3", "deformation_area_mm2"),
        features=features,
        truth=truth,
        phantom_index=np.arange(count - 9, count),
        dataset_sha256="ab" * 32,
        scene_defaults={"force_n": 1.0},
        excluded_rows=2,
    )


@pytest.fixture
def rows() -> TrainingRows:
    return synthetic_rows()


@pytest.fixture
def untrained(rows: TrainingRows) -> Trained:
    """Three random networks: enough for everything that does not depend on accuracy."""
    parameters = np.array([initial_parameters(np.random.default_rng(trial)) for trial in range(3)])
    return Trained(Ensemble(Scaling.fit(rows.features[rows.training_index]), parameters), rows, seed=1)
