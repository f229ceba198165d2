"""The map of bounds to the numbers of docs/accuracy.md: what no method can beat, scene by scene and summed up.

Of a bound the larger of both orders of elements counts; where they are apart, both are kept beside each other.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import RANGES
from device.measurement.quantities import UNKNOWNS
from host_tools.cramer_rao.accuracy_map import (
    MODULI_KPA,
    NOT_SMOOTH,
    PRECISE,
    SIZES_MM,
    STANDARD,
    MappedScene,
    deepest_mm,
    factors,
    stds,
    ways,
)
from host_tools.cramer_rao.accuracy_tables import BOX, MODULUS, determined_share, std_of_modulus, visible_line
from host_tools.cramer_rao.press_bound import OFFSETS_MM
from host_tools.cramer_rao.protocol import PressProtocol
from host_tools.forward.derivatives.sensitive_presses import ORDERS
from host_tools.pages.page import MOST

FIGURE = "accuracy_map.png"
NAMES = ("size", "depth", "modulus")
WELL, ROUGHLY = 0.1, 0.3
"""Known well and roughly: standard deviations of the logarithm."""
MOST_SCENES = 0.5
"""A way whose orders are apart in more scenes than this is not converged."""
ONE_SIDED_KPA = 60.0
"""An example of what an image may rule out below."""

Facts = dict[str, Any]


def accuracy_facts(scenes: list[MappedScene], beside: Array) -> Facts:
    """Return the page's numbers, by the names the template uses; standard deviations are of the logarithm.

    Lists of three go by size, depth and modulus. `beside` [offsets, pairs, moduli] is what a place beside the axis
    changes, of `press_bound.beside_over_axis`.
    """
    return {
        "box": [[RANGES[name].low, RANGES[name].high] for name in UNKNOWNS],
        "moduli_kpa": list(MODULI_KPA),
        "orders": list(ORDERS),
        "protocols": {name: _protocol(ways()[name]) for name in (STANDARD, PRECISE)},
        "known": _known(scenes),
        "smooth_error_factors": [float(f"{times:.6g}") for times in 1 / factors(scenes, NOT_SMOOTH)],
        "frames_factors": _numbers(1 / factors(scenes, PRECISE)),
        "worst_direction": _numbers(
            np.median([scene.limits[STANDARD].quoted.alone.worst_direction for scene in scenes], axis=0)
        ),
        "median": _medians(scenes),
        "identifiable": _identifiable(scenes),
        "deepest": _deepest(stds(scenes, STANDARD)),
        "ways": [_way(scenes, name) for name in ways()],
        "orders_differ": _orders_differ(scenes),
        "determined": _determined(scenes),
        "one_sided": {
            "from_kpa": ONE_SIDED_KPA,
            "box_ratio": _number(math.log(BOX.high / ONE_SIDED_KPA) / math.log(BOX.high / BOX.low)),
            "at_the_end_ratio": _number((1 - 2 / math.pi) ** 0.5),
        },
        "beside": _beside(beside),
        "scenes": [_scene(scene) for scene in scenes],
    }


def _protocol(protocol: PressProtocol) -> Facts:
    """Return frames, forces and what is not known, as the protocol has them."""
    ratios = {name: value for name, value in vars(protocol).items() if name.endswith(("_ratio", "spread_n"))}
    return {"frames": protocol.frames, "forces_n": list(protocol.forces_n), **ratios}


def _known(scenes: list[MappedScene]) -> list[Facts]:
    found = stds(scenes, STANDARD)
    counts = [[int(np.sum(found[..., i] <= level)) for level in (WELL, ROUGHLY)] for i in range(len(NAMES))]
    return [{"unknown": name, "well": well, "roughly": r} for name, (well, r) in zip(NAMES, counts, strict=True)]


def _medians(scenes: list[MappedScene]) -> Facts:
    return {
        "alone": _numbers(np.median(stds(scenes, STANDARD).reshape(-1, 3), axis=0)),
        "with_box": _numbers(np.median(stds(scenes, STANDARD, with_box=True).reshape(-1, 3), axis=0)),
        "box": _numbers(np.median([scene.limits[STANDARD].box_std for scene in scenes], axis=0)),
    }


def _identifiable(scenes: list[MappedScene]) -> Facts:
    """Return in how many scenes, and in how many pairs of size and depth whatever the modulus, the probe says so."""
    called = np.array([scene.limits[STANDARD].identifiable for scene in scenes])
    always = np.all(called.reshape(-1, len(MODULI_KPA), 3), axis=1)
    return {"scenes": called.sum(axis=0).tolist(), "pairs": always.sum(axis=0).tolist(), "of_pairs": len(always)}


def _deepest(found: Array) -> list[Facts]:
    """Return by size the depth down to which size, depth and modulus are known well and roughly, whatever E."""
    worst = found.max(axis=2)
    return [
        {
            "size_mm": size_mm,
            "deepest_mm": [deepest_mm(worst[i, :, k] <= level) for k in range(3) for level in (WELL, ROUGHLY)],
        }
        for i, size_mm in enumerate(SIZES_MM)
    ]


def _way(scenes: list[MappedScene], name: str) -> Facts:
    apart = sum(bool(scene.limits[name].not_converged) for scene in scenes)
    return {
        "way": name,
        "factors": _numbers(factors(scenes, name)),
        "roughly_known": (stds(scenes, name) <= ROUGHLY).sum(axis=(0, 1, 2)).tolist(),
        "orders_apart": apart,
        "converged": apart <= MOST_SCENES * len(scenes),
    }


def _orders_differ(scenes: list[MappedScene]) -> Facts:
    both = np.array([[limit.alone.std for limit in s.limits[STANDARD].by_order.values()] for s in scenes])
    apart = both.max(axis=1) / both.min(axis=1) - 1
    return {"median_ratio": _number(np.median(apart)), "most_ratio": _number(apart.max())}


def _determined(scenes: list[MappedScene]) -> Facts:
    """Return how often a posterior that knows the ends of the box determines the modulus, by size and depth."""
    per_pair = [scenes[i : i + len(MODULI_KPA)] for i in range(0, len(scenes), len(MODULI_KPA))]
    shares = [_row_determined(row) for row in per_pair]
    bold = [[scene.limits[STANDARD].identifiable[MODULUS] for scene in row] for row in per_pair]
    return {
        "pairs": [
            {"size_mm": row[0].inclusion[0], "depth_mm": row[0].inclusion[1], "shares": _numbers(of_row)}
            for row, of_row in zip(per_pair, shares, strict=True)
        ],
        "mean": _numbers(np.mean(shares, axis=0)),
        "identifiable": _numbers(np.mean(bold, axis=0)),
    }


def _row_determined(row: list[MappedScene]) -> list[float]:
    line = visible_line(MODULI_KPA, np.array([std_of_modulus(scene.limits[STANDARD]) for scene in row]))
    return [determined_share(line, modulus_kpa) for modulus_kpa in MODULI_KPA]


def _beside(beside: Array) -> list[Facts]:
    ratios = np.quantile(beside, [0.0, 0.5, 1.0], axis=1).transpose(1, 2, 0)
    return [
        {"offset_mm": offset_mm, "least_median_most": [_numbers(cell) for cell in row]}
        for offset_mm, row in zip(OFFSETS_MM, ratios, strict=True)
    ]


def _scene(scene: MappedScene) -> Facts:
    size_mm, depth_mm, modulus_kpa = scene.inclusion
    boxed = scene.limits[STANDARD]
    return {
        "size_mm": size_mm,
        "depth_mm": depth_mm,
        "modulus_kpa": modulus_kpa,
        **{name: _numbers(scene.limits[name].std) for name in (STANDARD, PRECISE)},
        "with_box": _numbers(boxed.std_with_box),
        "identifiable": [bool(known) for known in boxed.identifiable],
        "apart": {name: _by_order(scene, name) for name in (STANDARD, PRECISE) if scene.limits[name].not_converged},
    }


def _by_order(scene: MappedScene, way: str) -> list[list[float | None]]:
    """Return each unknown's bounds by the order of the elements."""
    both = np.array([scene.limits[way].by_order[order].alone.std for order in ORDERS])
    return [_numbers(of_unknown) for of_unknown in both.T]


def _numbers(values: Array | list[float]) -> list[float | None]:
    return [_number(value) for value in values]


def _number(value: float) -> float | None:
    """Return a number to six digits; None for a bound that is too large to mean anything."""
    return float(f"{value:.6g}") if value <= MOST else None
