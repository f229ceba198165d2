"""Rows of a sweep that cost nothing."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from host_tools.data.executors import Case
from host_tools.data.journal import Row
from host_tools.data.rows import Truth, empty_row

SCENES = 6


def synthetic_row(index: int, truth: Truth) -> Row:
    """A row of real size that is solved without finite elements; its profiles begin with the index."""
    profiles = np.random.default_rng(index).normal(size=(3, 221))
    profiles[:, 0] = index
    r_mm = {"r_mm": np.linspace(0.0, 11.0, 221).tolist()}
    return (
        empty_row(index, truth) | r_mm | dict(zip(("w_mm", "w_baseline_mm", "p_kpa"), profiles.tolist(), strict=True))
    )


def synthetic_rows(solve: Callable[[int, Truth], Row], cases: Iterable[Case]) -> Iterator[Row]:
    """An executor whose rows are synthetic."""
    return (synthetic_row(*case) for case in cases)
