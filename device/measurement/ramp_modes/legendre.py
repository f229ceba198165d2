"""Polynomials in several variables as sums of products of Legendre polynomials, with their gradient.

Source: Trefethen, Approximation Theory and Approximation Practice, 2013; products: any text on polynomial chaos.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from device.measurement.arrays import Array


@dataclass(frozen=True, eq=False)
class LegendreSum:
    """`degrees` [M, V] of each term in each of V variables, `coefficients` [M, Q] of Q outputs."""

    degrees: NDArray[np.uint8]
    coefficients: Array

    def values(self, at: Array) -> Array:
        """Return the outputs [n, Q] at points [n, V] of the cube from -1 to 1."""
        return np.asarray(terms(self.degrees, at) @ self.coefficients)

    def gradient(self, at: Array) -> Array:
        """Return the derivatives [V, n, Q] of the outputs by each variable."""
        tables = [_table(column, degree) for column, degree in zip(at.T, self.degrees.T, strict=True)]
        slopes = [_slopes(column, degree) for column, degree in zip(at.T, self.degrees.T, strict=True)]
        rows = []
        for variable, slope in enumerate(slopes):
            others = [slope if other == variable else table for other, table in enumerate(tables)]
            rows.append(np.prod(others, axis=0) @ self.coefficients)
        return np.array(rows)


def terms(degrees: NDArray[np.uint8], at: Array) -> Array:
    """Return the terms [n, M] at points [n, V]: products of Legendre polynomials of the given degrees [M, V]."""
    product = np.ones((len(at), len(degrees)))
    for column, degree in zip(at.T, degrees.T, strict=True):
        if degree.any():
            product *= _table(column, degree)
    return product


def _table(column: Array, degree: NDArray[np.uint8]) -> Array:
    return np.asarray(legendre.legvander(column, int(degree.max()))[:, degree])


def _slopes(column: Array, degree: NDArray[np.uint8]) -> Array:
    highest = int(degree.max())
    derivatives = np.zeros((highest + 1, highest + 1))
    for k in range(1, highest + 1):
        derivatives[:k, k] = legendre.legder(np.eye(highest + 1)[k])[:k]
    return np.asarray((legendre.legvander(column, highest) @ derivatives)[:, degree])
