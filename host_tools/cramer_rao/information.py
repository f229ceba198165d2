"""A linear measurement with Gaussian errors to the least error of any estimate: the Cramer-Rao bound.

What is not asked for but not known either counts as noise: its covariance is added to that of the measurement, which is
the same as estimating it too (Schur complement). A bound of the logarithm far above 0.5 only says "not known".
Source: Kay, Fundamentals of Statistical Signal Processing: Estimation Theory (1993), sections 3.7 and 10.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array


@dataclass(frozen=True, eq=False)
class CramerRao:
    """Bound on U unknowns: standard deviations `std` [U], and the direction in which they are known worst.

    `correlation` [U, U]; `worst_direction` [U] is a unit vector and `worst_std` the standard deviation along it. Where
    nothing is known of a direction, standard deviations are infinite and correlations nan.
    """

    std: Array
    correlation: Array
    worst_direction: Array
    worst_std: float


def with_nuisances(covariance: Array, jacobian: Array, spread: Array) -> Array:
    """Return the covariance [N, N] of a measurement that also varies with nuisances.

    jacobian [N, M]: derivatives by them; spread [M]: their standard deviations, 0 for one that is known.
    """
    scaled = jacobian * spread
    return np.asarray(covariance + scaled @ scaled.T)


def cramer_rao(jacobian: Array, covariance: Array, prior_std: Array | None = None) -> CramerRao:
    """Return the bound on unknowns from derivatives [N, U] of a measurement of a covariance [N, N], positive definite.

    prior_std [U]: standard deviations of what is known of the unknowns beforehand.
    """
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), jacobian)
    if prior_std is not None:
        whitened = np.vstack([whitened, np.diag(1 / prior_std)])
    scale = np.linalg.norm(whitened, axis=0)  # units of the unknowns must not decide what counts as zero
    scale[scale == 0] = 1.0
    _, singular, directions = np.linalg.svd(whitened / scale, full_matrices=False)
    rank_limit = np.finfo(float).eps * max(whitened.shape)
    if len(whitened) < len(scale) or singular[-1] <= rank_limit:
        return _unknown(len(scale))
    root = directions.T / singular / scale[:, None]
    covariance_of_unknowns = root @ root.T
    return _bound(covariance_of_unknowns)


def _bound(covariance: Array) -> CramerRao:
    std = np.sqrt(np.diag(covariance))
    values, vectors = np.linalg.eigh(covariance)
    worst = vectors[:, -1] * np.sign(vectors[np.abs(vectors[:, -1]).argmax(), -1])
    return CramerRao(std, covariance / np.outer(std, std), worst, float(np.sqrt(values[-1])))


def _unknown(unknowns: int) -> CramerRao:
    return CramerRao(
        np.full(unknowns, np.inf), np.full((unknowns, unknowns), np.nan), np.full(unknowns, np.nan), np.inf
    )
