"""How many cores a solve takes: one, but for stiffness in 3-D where one scene is solved at a time.

A 2-D solve gains nothing from threads, and a sweep, a process for each core, loses by them: NGSolve's wait by spinning.
"""

from __future__ import annotations

import os

os.environ.setdefault("NGS_NUM_THREADS", "1")  # for processes begun from here that import NGSolve alone

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from ngsolve import SetNumThreads, TaskManager

SetNumThreads(1)
_cores = ContextVar("cores", default=1)


@contextmanager
def on_cores(cores: int) -> Iterator[None]:
    """Factorise stiffness in 3-D on so many cores meanwhile, for who solves one scene and not one in each process.

    Numbers of 3-D then differ from those of one core by rounding.
    """
    before = _cores.set(cores)
    try:
        yield
    finally:
        _cores.reset(before)


@contextmanager
def factorising_in_3d() -> Iterator[None]:
    """Take all cores that `on_cores` allows meanwhile, and one again after."""
    if (cores := _cores.get()) == 1:
        yield
        return
    SetNumThreads(cores)
    try:
        with TaskManager():
            yield
    finally:
        SetNumThreads(1)
