"""Where size, depth and modulus of an inclusion can be known: Cramer-Rao bounds over the box, and over ways to measure.

Each scene is solved once; every way to measure then looks at the same faces. `accuracy_page` makes of it the numbers
of docs/accuracy.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from device.files.shipped import PROTOCOLS
from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from host_tools.cramer_rao.bounds import Limits, limit_of_observed, std_of_box
from host_tools.cramer_rao.observed_press import ObservedPress, observed_presses, rings_of
from host_tools.cramer_rao.protocol import Observable, PressProtocol, read_protocol
from host_tools.forward.derivatives.sensitive_presses import Ramps, sensitive_ramp
from host_tools.scenes.scene import Scene

SIZES_MM, DEPTHS_MM, MODULI_KPA = (3.0, 6.0, 10.0, 15.0), (4.0, 6.0, 8.0, 12.0), (15.0, 40.0, 80.0, 120.0)
STANDARD, PRECISE, NOT_SMOOTH = "standard", "precise", "standard, no smooth error"
UNKNOWN_RATIO = 10.0
OBSERVABLES: tuple[Observable, ...] = ("image", "pressure", "displacement")
"""What is looked at; the scalars are made of the image."""

Triple = tuple[float, float, float]
"""Size (mm), depth (mm) and Young's modulus (kPa) of an inclusion."""


@dataclass(frozen=True, eq=False)
class MappedScene:
    """The bounds of every way to measure one inclusion, by its name."""

    inclusion: Triple
    limits: Mapping[str, Limits]


def ways() -> dict[str, PressProtocol]:
    """Return the ways to measure that the map compares; all but the precise one take as many frames."""
    standard, precise = (read_protocol(PROTOCOLS / f"{name}.toml") for name in (STANDARD, PRECISE))
    one_load = replace(standard, forces_n=standard.forces_n[-1:])
    return {
        STANDARD: standard,
        PRECISE: precise,
        NOT_SMOOTH: replace(standard, systematic_ratio=0.0),
        "standard, gain unknown": replace(standard, gain_spread_ratio=UNKNOWN_RATIO),
        "standard, tissue and skin known": replace(
            standard,
            tissue_modulus_spread_ratio=0.0,
            thickness_spread_ratio=0.0,
            contact_law_spread_ratio=0.0,
            albedo_spread_ratio=0.0,
            scattering_spread_ratio=0.0,
        ),
        "standard, largest load only": one_load,
        "three scalars": replace(standard, observable="scalars"),
        "three scalars, largest load only": replace(one_load, observable="scalars"),
        "pressure itself": replace(standard, observable="pressure"),
        "pressure itself, largest load only": replace(one_load, observable="pressure"),
        "displacement itself": replace(standard, observable="displacement"),
        "displacement itself, largest load only": replace(one_load, observable="displacement"),
    }


def inclusions() -> list[Triple]:
    """Return the inclusions of the map, those of one size and depth together: they share the solve of the baseline."""
    return list(product(SIZES_MM, DEPTHS_MM, MODULI_KPA))


def mapped_scene(inclusion: Triple) -> MappedScene:
    """Solve one inclusion and return its bounds."""
    compared = ways()
    ramps = sensitive_ramp(Scene(Inclusion(*inclusion)), compared[STANDARD].forces_n)
    seen = {order: {what: observed_presses(ramp, what) for what in OBSERVABLES} for order, ramp in ramps.items()}
    return MappedScene(
        inclusion, {name: _limits(inclusion, ramps, seen, protocol) for name, protocol in compared.items()}
    )


def _limits(
    inclusion: Triple,
    ramps: Ramps,
    seen: Mapping[int, Mapping[Observable, list[ObservedPress]]],
    protocol: PressProtocol,
) -> Limits:
    what: Observable = "image" if protocol.observable == "scalars" else protocol.observable
    rings = rings_of(next(iter(ramps.values())))
    loads, box_std = len(protocol.forces_n), std_of_box(Inclusion(*inclusion))
    by_order = {order: limit_of_observed(by[what][-loads:], rings, protocol, box_std) for order, by in seen.items()}
    return Limits(by_order, box_std)


def stds(scenes: list[MappedScene], way: str, *, with_box: bool = False) -> Array:
    """Return the bounds [sizes, depths, moduli, 3] of one way to measure, of a whole map."""
    rows = [s.limits[way].std_with_box if with_box else s.limits[way].std for s in scenes]
    return np.array(rows).reshape(len(SIZES_MM), len(DEPTHS_MM), len(MODULI_KPA), 3)


def factors(scenes: list[MappedScene], way: str) -> Array:
    """Return the bounds [3] of a way over those of the standard one, medians over all scenes."""
    return np.asarray(np.median(stds(scenes, way) / stds(scenes, STANDARD), axis=(0, 1, 2)))


def deepest_mm(known: Array) -> float | None:
    """Return the largest depth down to which every depth [D] counts as known; None if not even the first does."""
    count = int(np.argmin([*known.tolist(), False]))
    return DEPTHS_MM[count - 1] if count else None
