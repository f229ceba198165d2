"""Trained networks to ONNX: an ensemble to size, depth, modulus and their spread; the range classifier to log odds.

The ensemble answers in mm, mm and kPa; its spread stays in coordinates, -1 to 1 over the trained range, in which the
belts of a card are. The classifier has one output, for presses of any mode (`range.onnx`, docs/contracts.md).
Operators: the ONNX standard, opset 17.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import BY_RATIO, HIGH, LOW, denormalise_unknowns
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.range_classifier import OUTPUT
from host_tools.paper_network.export import AGREEMENT, OnnxGraph, agreed_outputs
from host_tools.press_models.dense_network import LARGEST_LOG_VARIANCE, DenseLayer, InputScaling
from host_tools.press_models.train_ensemble import DenseEnsemble
from host_tools.press_models.train_range import DEPTHS, SIZES, RangeNetwork, TrainedRange

STORED_AS = {"trained_on": "pool", "evaluated": "judged"}
"""Entries of a training budget that the committed cards know by older names."""


def build_network(ensemble: DenseEnsemble) -> bytes:
    """Return the ensemble as serialised ONNX: features float32 [n, P] -> estimate, spread float32 [n, 3]."""
    graph = OnnxGraph()
    outputs = add_members(graph, ensemble.scaling, ensemble.members)  # [members, n, 6]
    select = np.eye(2 * len(UNKNOWNS), dtype=np.float32)
    means = graph.add("MatMul", outputs, select[:, : len(UNKNOWNS)])
    log_variances = graph.add(
        "Min", graph.add("MatMul", outputs, select[:, len(UNKNOWNS) :]), np.float32(LARGEST_LOG_VARIANCE)
    )
    mean = graph.add("ReduceMean", means, axes=[0], keepdims=0)
    away = graph.add("Sub", means, mean)
    within = graph.add("ReduceMean", graph.add("Exp", log_variances), axes=[0], keepdims=0)
    between = graph.add("ReduceMean", graph.add("Mul", away, away), axes=[0], keepdims=0)
    graph.add("Sqrt", graph.add("Add", within, between), output="spread")
    _add_physical(graph, mean)
    return graph.serialise(len(ensemble.scaling.mean))


def add_members(graph: OnnxGraph, scaling: InputScaling, members: Sequence[list[DenseLayer]]) -> str:
    """Add networks that share their inputs; return the name of their outputs [members, n, ...]."""
    plain = graph.add("MatMul", graph.add("Sub", "features", scaling.mean), scaling.projection)
    area_sine = graph.add("Div", graph.add("Asinh", plain), scaling.area_sine_spread)
    signal = graph.add("Concat", graph.add("Div", plain, scaling.plain_spread), area_sine, axis=1)
    *hidden, last = (
        [np.stack([getattr(layers[i], part) for layers in members]) for part in ("weights", "biases")]
        for i in range(len(members[0]))
    )
    for weights, biases in hidden:
        signal = graph.add("Tanh", graph.add("Add", graph.add("MatMul", signal, weights), biases[:, None]))
    return graph.add("Add", graph.add("MatMul", signal, last[0]), last[1][:, None])


def _add_physical(graph: OnnxGraph, mean: str) -> None:
    """Add the unknowns of coordinates: linear, and through the exponential where ratios count."""
    count = len(UNKNOWNS)
    by_ratio = BY_RATIO[:count].astype(np.float32)
    low, high = (np.where(BY_RATIO[:count], np.log(ends[:count]), ends[:count]) for ends in (LOW, HIGH))
    half, middle = (np.asarray(part, np.float32) for part in ((high - low) / 2, (high + low) / 2))
    even = graph.add("Add", graph.add("Mul", mean, half), middle)
    ratio = graph.add("Mul", graph.add("Exp", graph.add("Mul", even, by_ratio)), by_ratio)
    graph.add("Add", graph.add("Mul", even, 1 - by_ratio), ratio, output="estimate")


def physical_estimate(ensemble: DenseEnsemble, rows: Array) -> tuple[Array, Array]:
    """Return estimate (mm, mm, kPa) and spread (coordinates) [n, 3], as the exported network gives them."""
    mean, spread = ensemble.estimate(rows)
    return denormalise_unknowns(mean), spread


def golden_vectors(ensemble: DenseEnsemble, network: bytes, rows: Array) -> dict[str, list[list[float]]]:
    """Return rows [n, P] and what the exported network answers; raises `ExportRefused` when NumPy answers otherwise."""
    expected = dict(zip(("estimate", "spread"), physical_estimate(ensemble, rows), strict=True))
    found = agreed_outputs(network, rows, expected, tolerance=20 * AGREEMENT)
    return {"features": rows.tolist()} | {name: one.tolist() for name, one in found.items()}


def build_range_network(network: RangeNetwork) -> bytes:
    """Return the networks as serialised ONNX: features float32 [n, F] -> float32 [n, 1]."""
    graph = OnnxGraph()
    graph.add("ReduceMean", add_members(graph, network.scaling, network.members), axes=[0], keepdims=0, output=OUTPUT)
    return graph.serialise(len(network.scaling.mean), {OUTPUT: 1})


def budget_entry(budget: Mapping[str, Any]) -> dict[str, Any]:
    """Return a training budget as a card states it, under `effort`."""
    return {
        STORED_AS.get(name, name): budget_entry(value) if isinstance(value, Mapping) else value
        for name, value in budget.items()
    }


def range_entry(trained: TrainedRange, network: bytes, rows: Array) -> dict[str, Any]:
    """Return what the card says of the networks; `rows` [n, P] are the golden features of the bundle.

    Raises `ExportRefused` when onnxruntime and NumPy differ.
    """
    expected = {OUTPUT: trained.network.log_odds(rows)[:, None]}
    golden = agreed_outputs(network, rows, expected, tolerance=20 * AGREEMENT, floor=1.0, of=" of the ranges")
    return {
        "sha256": hashlib.sha256(network).hexdigest(),
        "size_mm": list(SIZES),
        "depth_mm": list(DEPTHS),
        "dataset_sha256": trained.dataset_sha256,
        "effort": budget_entry(asdict(trained.budget)),
        "surrogate_error": {
            "largest": float(trained.surrogate_error.max()),
            "mean": float(trained.surrogate_error.mean()),
        },
        "golden": {mode: [float(one) for one in column[:, 0]] for mode, column in golden.items()},
    }
