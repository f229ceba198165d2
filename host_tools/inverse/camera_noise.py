"""Recordings of random presses to the camera's part of the noise: how profile rows scatter about the exact ones.

Camera, cell and the hand's tremor are in it; drift of light and cell and smooth errors are not, they have levels of
their own. Fewer recordings than squares of columns leave a covariance that is partly chance: correlations are shrunk.
Source of the shrinkage: Schaefer & Strimmer, Stat. Appl. Genet. Mol. Biol. 4 (2005), table 1, target D.
"""

from __future__ import annotations

import numpy as np

from device.measurement.mode import Mode
from device.measurement.press_noise import light_ratio
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.press_samples import Array, draw_parameters, profile_rows
from host_tools.inverse.recorded_presses import in_parallel, record_presses


def camera_covariance(tables: ProbeTables, mode: Mode, count: int, *, seed: int, jobs: int = -1) -> Array:
    """Return the covariance [P, P] of `count` random presses' rows about the exact ones, over the light ratio there."""
    parameters = draw_parameters(count, np.random.default_rng(seed))
    recorded = record_presses(tables, parameters, mode, seed=seed, jobs=jobs).rows
    exact = np.array(in_parallel(lambda i: profile_rows(tables, parameters[i : i + 1])[0], count, jobs))
    return shrunk_covariance((recorded - exact) / light_ratio(exact))


def shrunk_covariance(errors: Array) -> Array:
    """Return the mean square [P, P] of errors [n, P], correlations shrunk by as much as chance made them."""
    std = np.sqrt(np.mean(errors**2, axis=0))
    standard = errors / std
    correlation = standard.T @ standard / len(errors)
    shrunk = (1 - shrinkage(standard, correlation)) * correlation
    np.fill_diagonal(shrunk, 1.0)
    return np.asarray(std[:, None] * std * shrunk)


def shrinkage(standard: Array, correlation: Array) -> float:
    """Return by how much correlations [P, P] of n standardised errors [n, P] are to be shrunk: 0 to 1.

    The sum of their sampling variances over the sum of their squares, both off the diagonal.
    """
    count = len(standard)
    apart = ~np.eye(len(correlation), dtype=bool)
    fourth = (standard**2).T @ standard**2 / count
    variance = (fourth - correlation**2) / (count - 1)
    return float(np.clip(variance[apart].sum() / (correlation[apart] ** 2).sum(), 0.0, 1.0))
