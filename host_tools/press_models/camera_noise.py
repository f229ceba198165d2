"""Recordings of random presses to the camera's part of the noise: how what is read scatters about the exact values.

Camera, cell and the hand's tremor are in it; drift of light and cell and smooth errors are not, they have levels of
their own. A force that is read wrong moves all rings alike, so what few rings tell by themselves is far below any
column's noise. Correlations are therefore shrunk no more than recordings kept apart ask for: those of a closed formula
(Schaefer & Strimmer, Stat. Appl. Genet. Mol. Biol. 4, 2005), which cares for large correlations only, made that noise
three times as large as it is. Source: Warton, JASA 103 (2008), shrinkage by cross-validated likelihood.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.ramp_modes.noise import light_ratio
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.press_samples import draw_beside, draw_parameters, profile_rows
from host_tools.press_models.recorded_presses import direction_of_press_rad, in_parallel, record_presses
from host_tools.press_models.seeds import derived_seed, press_seed

PARTS = 5
SHRINKAGES = np.geomspace(1e-4, 1.0, 33)
TINY = 1e-9
"""A column that is 0 in all but one part of the errors still has a covariance that can be inverted."""


def camera_noise(tables: ProbeTables, near: int, beside: int, *, seed: int, jobs: int = -1) -> Array:
    """Return the covariance [P, P] of profile rows of random presses about the exact ones, over the light.

    So many presses lie `near` the inclusion, and so many `beside` it.
    """
    errors = [
        recorded_errors(tables, draw(count, np.random.default_rng(own)), seed=own, jobs=jobs)
        for count, draw, own in (
            (near, draw_parameters, derived_seed(seed, "camera of standard")),
            (beside, draw_beside, derived_seed(seed, "camera beside")),
        )
    ]
    return shrunk_covariance(np.concatenate(errors))


def recorded_errors(tables: ProbeTables, parameters: Array, *, seed: int, jobs: int = -1) -> Array:
    """Return by how much rows of recorded presses with parameters [n, 9] differ from exact ones [n, P], over the light.

    Drift of light and cell and smooth errors are not in it.
    """
    recorded = record_presses(tables, parameters, "standard", seed=seed, jobs=jobs)
    exact = exact_rows(tables, parameters, seed=seed, jobs=jobs)
    return (np.concatenate(recorded.rows) - exact) / light_ratio(exact)


def exact_rows(tables: ProbeTables, parameters: Array, *, seed: int, jobs: int = -1) -> Array:
    """Return the profile rows [n, P] without noise of presses that are recorded with a seed, each in its direction."""

    def exact(number: int) -> Array:
        direction_rad = np.array([direction_of_press_rad(press_seed(seed, number))])
        return np.asarray(profile_rows(tables, parameters[number : number + 1], direction_rad)[0])

    return np.array(in_parallel(exact, len(parameters), jobs))


def shrunk_covariance(errors: Array) -> Array:
    """Return the mean square [P, P] of errors [n, P], correlations shrunk by as much as chance made them."""
    std = np.sqrt(np.mean(errors**2, axis=0))
    standard = errors / std
    return np.asarray(std[:, None] * std * _shrunk_correlation(standard, shrinkage(standard)))


def shrinkage(standard: Array) -> float:
    """Return by how much correlations of n standardised errors [n, P] are to be shrunk: one of `SHRINKAGES`.

    It is the one under which parts of the errors are likeliest by the others' correlations.
    """
    parts = np.array_split(np.arange(len(standard)), min(PARTS, len(standard)))
    likely = [sum(_log_likelihood(standard, part, ratio) for part in parts) for ratio in SHRINKAGES]
    return float(SHRINKAGES[int(np.argmax(likely))])


def _log_likelihood(standard: Array, part: NDArray[np.intp], ratio: float) -> float:
    """Return the Gaussian log likelihood of a part of errors [n, P] by the shrunk correlations of the others."""
    correlation = _shrunk_correlation(np.delete(standard, part, axis=0), ratio)
    factor = np.linalg.cholesky(correlation)
    whitened = np.linalg.solve(factor, standard[part].T)
    return float(-0.5 * np.sum(whitened**2) - len(part) * np.log(np.diag(factor)).sum())


def _shrunk_correlation(standard: Array, ratio: float) -> Array:
    """Return the mean products [P, P] of errors [n, P], those of two columns less by a ratio."""
    count, columns = standard.shape
    correlation = standard.T @ standard / max(count, 1)
    shrunk = (1 - ratio) * correlation + ratio * np.diag(np.diag(correlation))
    shrunk[np.diag_indices(columns)] += ratio * TINY
    return np.asarray(shrunk)
