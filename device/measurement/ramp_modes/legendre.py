"""Polynomials in several variables as sums of products of Legendre polynomials, with their gradient.

A product of several variables' polynomials is a product of one variable less, times one polynomial: so every term costs
one multiplication, and its derivatives two each.
Source: Trefethen, Approximation Theory and Approximation Practice, 2013; products: any text on polynomial chaos;
recurrences of the polynomials and of their derivatives: NIST Digital Library of Mathematical Functions, 14.10.3 and
18.9.19.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array

TermNumbers = NDArray[np.intp]
Degrees = tuple[int, ...]
POINTS_AT_ONCE = 256
"""The terms of so many points stay in a core's cache."""


class _Level(NamedTuple):
    """Terms `rows` of equally many variables: each is term `parent` times the polynomial of a degree and variable."""

    rows: slice
    parent: TermNumbers
    variable: TermNumbers
    degree: TermNumbers


@dataclass(frozen=True, eq=False)
class LegendreSum:
    """`degrees` [M, V] of each term in each of V variables, `coefficients` [M, Q] of Q outputs."""

    degrees: NDArray[np.uint8]
    coefficients: Array

    def values(self, at: Array) -> Array:
        """Return the outputs [n, Q] at points [n, V] of the cube from -1 to 1, in the precision of the points."""
        polynomials = self._terms.polynomials(at)
        parts = np.split(polynomials, range(POINTS_AT_ONCE, len(at), POINTS_AT_ONCE), axis=2)
        outputs_of_terms = self._outputs_of_terms(at)
        return np.concatenate([outputs_of_terms @ self._terms.tree_values(part) for part in parts], axis=1).T

    def values_and_gradient(self, at: Array) -> tuple[Array, Array]:
        """Return the outputs [n, Q] and their derivatives [V, n, Q] by each variable, in the points' precision."""
        terms = self._terms.tree_values_and_slopes(at)
        flat = self._outputs_of_terms(at) @ terms.reshape(len(terms), -1)
        outputs = flat.reshape(-1, *terms.shape[1:]).transpose(1, 2, 0)
        return outputs[0], outputs[1:]

    def _outputs_of_terms(self, at: Array) -> NDArray[Any]:
        return (self._ordered_single if at.dtype == np.float32 else self._ordered).T

    @cached_property
    def _terms(self) -> LegendreTerms:
        return LegendreTerms(self.degrees)

    @cached_property
    def _ordered(self) -> Array:
        """The coefficients [T, Q] in the tree's order; those of terms that only lead to others are 0."""
        ordered = np.zeros((self._terms.size, self.coefficients.shape[1]))
        np.add.at(ordered, self._terms.places, self.coefficients)
        return ordered

    @cached_property
    def _ordered_single(self) -> NDArray[np.float32]:
        return self._ordered.astype(np.float32)


class LegendreTerms:
    """Products of Legendre polynomials of the degrees [M, V], laid out as a tree of T >= M of them.

    `places` [M]: where the tree has each one.
    """

    def __init__(self, degrees: NDArray[np.uint8]) -> None:
        wanted: list[Degrees] = [tuple(term) for term in degrees.tolist()]
        order = _tree_order(wanted, degrees.shape[1])
        self.size, self.places, self._highest = (
            len(order),
            np.array([order[term] for term in wanted]),
            int(degrees.max()),
        )
        self._levels = _levels(order)

    def values(self, at: Array) -> Array:
        """Return the terms [n, M] at points [n, V]."""
        return np.ascontiguousarray(self.tree_values(self.polynomials(at))[self.places].T)

    def polynomials(self, at: Array) -> Array:
        """Return the polynomials [highest + 1, V, n] of every variable at points [n, V], degree by degree."""
        return _polynomials(at, self._highest)

    def tree_values(self, polynomials: Array) -> Array:
        """Return the tree's terms [T, n] at points with those polynomials [highest + 1, V, n]."""
        terms = np.ones((self.size, polynomials.shape[2]), polynomials.dtype)
        for level in self._levels:
            np.multiply(terms[level.parent], polynomials[level.degree, level.variable], out=terms[level.rows])
        return terms

    def tree_values_and_slopes(self, at: Array) -> Array:
        """Return the tree's terms, and their derivatives by each variable [T, 1 + V, n], by the product rule."""
        polynomials = self.polynomials(at)
        slopes = _slopes(polynomials)
        terms = np.zeros((self.size, 1 + at.shape[1], len(at)), at.dtype)
        terms[0, 0] = 1
        for level in self._levels:
            factor = level.degree, level.variable
            terms[level.rows] = terms[level.parent] * polynomials[factor][:, None]
            own = np.arange(level.rows.start, level.rows.stop), 1 + level.variable
            terms[own] += terms[level.parent, 0] * slopes[factor]
        return terms


def _tree_order(wanted: list[Degrees], variables: int) -> dict[Degrees, int]:
    """Return the place of every term: after the one of a variable less, which is added where nobody wants it."""
    needed: set[Degrees] = {(0,) * variables}
    for term in wanted:
        while term not in needed:
            needed.add(term)
            term = _parent(term)
    return {term: place for place, term in enumerate(sorted(needed, key=lambda term: (_variables(term), term)))}


def _levels(order: dict[Degrees, int]) -> list[_Level]:
    entries: dict[int, list[tuple[int, int, int, int]]] = {}
    for term, place in list(order.items())[1:]:
        variable = _last_variable(term)
        entries.setdefault(_variables(term), []).append((place, order[_parent(term)], variable, term[variable]))
    columns = (np.array(entries[count]).T for count in sorted(entries))
    return [_Level(slice(places[0], places[-1] + 1), *others) for places, *others in columns]


def _variables(term: Degrees) -> int:
    """Return of how many variables a term is."""
    return sum(degree > 0 for degree in term)


def _parent(term: Degrees) -> Degrees:
    """Return a term without its last variable."""
    last = _last_variable(term)
    return (*term[:last], 0, *term[last + 1 :])


def _last_variable(term: Degrees) -> int:
    return max(variable for variable, degree in enumerate(term) if degree)


def _polynomials(at: Array, highest: int) -> Array:
    """Return the polynomials [highest + 1, V, n] of every variable, degree by degree."""
    x = at.T
    values = np.ones((highest + 1, *x.shape), x.dtype)
    values[1:2] = x
    for k in range(2, highest + 1):
        values[k] = ((2 * k - 1) * x * values[k - 1] - (k - 1) * values[k - 2]) / k
    return values


def _slopes(polynomials: Array) -> Array:
    """Return the derivatives of the polynomials [highest + 1, V, n], by their variable each."""
    slopes = np.zeros_like(polynomials)
    slopes[1:2] = 1
    for k in range(2, len(polynomials)):
        slopes[k] = slopes[k - 2] + (2 * k - 1) * polynomials[k - 1]
    return slopes
