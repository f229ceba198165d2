"""The chapters of the verification by name, in the order of the document."""

from __future__ import annotations

from collections.abc import Callable

import host_tools.forward.solve  # noqa: F401 - sets the number of threads before the mesher starts any
from host_tools.study import (
    balance,
    basis,
    eshelby,
    hayes,
    hertz,
    incompressible,
    patch,
    peer_calculix,
    rates,
    scene_rates,
    smoothness,
    symmetries,
)
from host_tools.study.benchmark import Chapter

CHAPTERS: dict[str, Callable[[bool], Chapter]] = {
    "patch": patch.chapter,
    "eshelby": eshelby.chapter,
    "hayes": hayes.chapter,
    "hertz": hertz.chapter,
    "rates": rates.chapter,
    "scene_rates": scene_rates.chapter,
    "incompressible": incompressible.chapter,
    "symmetries": symmetries.chapter,
    "balance": balance.chapter,
    "smoothness": smoothness.chapter,
    "basis": basis.chapter,
    "calculix": peer_calculix.chapter,
}
"""Each function takes whether to be quick."""
