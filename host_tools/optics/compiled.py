"""The decorator of every compiled function of the ray tracer.

Nothing is cached on disk: numba's cache does not notice that a called function in another file has changed, and a stale
tracer would silently keep its old physics. Compiling takes a few seconds. Source: numba's documentation, "Notes on
caching".
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., object])


def compiled(function: Function) -> Function:
    """Return the function compiled by numba at its first call, for its types; strict floating point, one thread."""
    return cast(Function, njit(function))
