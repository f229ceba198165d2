"""Recordings of random presses to the camera's part of the noise: how what is read scatters about the exact values.

Camera, cell and the hand's tremor are in it; drift of light and cell and smooth errors are not, they have levels of
their own. Fewer recordings than squares of columns leave a covariance that is partly chance: correlations are shrunk.
Source of the shrinkage: Schaefer & Strimmer, Stat. Appl. Genet. Mol. Biol. 4 (2005), table 1, target D.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.ramp_modes.noise import LOADS, light_ratio
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS
from device.measurement.recording.ring_means import RINGS
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.press_samples import draw_parameters, exact_presses
from host_tools.press_models.recorded_presses import in_parallel, record_presses


class CameraNoise(NamedTuple):
    """Covariances of a mode over the light ratio: of profile rows [P, P], and of second harmonics [Q, Q]."""

    rows: Array
    second_harmonics: Array


def camera_noise(tables: ProbeTables, mode: Mode, count: int, *, seed: int, jobs: int = -1) -> CameraNoise:
    """Return the covariances of `count` random presses about the exact ones.

    What lies across the offset, where a round inclusion has no second harmonic, counts as much as what lies along it.
    """
    parameters = draw_parameters(count, np.random.default_rng(seed))
    recorded = record_presses(tables, parameters, mode, seed=seed, jobs=jobs)
    exact = in_parallel(lambda i: exact_presses(tables, parameters[i : i + 1]), count, jobs)
    rows, along = (np.concatenate(part) for part in zip(*exact, strict=True))
    second = recorded.second_harmonics.reshape(count, 2, -1) - np.stack([along, np.zeros_like(along)], axis=1)
    light = 1 + rows[:, :CONTRAST_COLUMNS].reshape(count, LOADS, RINGS)[:, :, 1:-1].reshape(count, 1, -1)
    return CameraNoise(
        shrunk_covariance((recorded.rows - rows) / light_ratio(rows)),
        shrunk_covariance((second / light).reshape(2 * count, -1)),
    )


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
