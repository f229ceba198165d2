"""A trained ensemble to ONNX: rows of a press to size, depth and modulus, and the spread of their coordinates.

The network answers in mm, mm and kPa; its spread stays in coordinates, -1 to 1 over the trained range, in which the
bands of a card are. Operators: the ONNX standard, opset 17.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.measurement.inversion import open_session
from device.measurement.press_parameters import BY_RATIO, HIGH, LOW, unknowns_from_unit
from device.measurement.quantities import UNKNOWNS
from host_tools.inverse.dense_network import LARGEST_LOG_VARIANCE, Array, InputScaling, Layer
from host_tools.inverse.export import AGREEMENT, ExportRefused, OnnxGraph
from host_tools.inverse.train_ensemble import DenseEnsemble


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


def add_members(graph: OnnxGraph, scaling: InputScaling, members: Sequence[list[Layer]]) -> str:
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
    return unknowns_from_unit(mean), spread


def golden_vectors(ensemble: DenseEnsemble, network: bytes, rows: Array) -> dict[str, list[list[float]]]:
    """Return rows [n, P] and what the exported network answers; raises `ExportRefused` when NumPy answers otherwise."""
    expected = physical_estimate(ensemble, rows)
    found = open_session(network).run(["estimate", "spread"], {"features": rows.astype(np.float32)})
    worst = max(float(np.max(np.abs(f - e) / np.abs(e))) for f, e in zip(found, expected, strict=True))
    if not worst <= 20 * AGREEMENT:
        found_and_bound = f"by {worst:.2g} relative, but must agree within {20 * AGREEMENT:.0g}"
        raise ExportRefused(
            f"The exported network differs from NumPy {found_and_bound}: nothing was written, train anew."
        )
    return {
        "features": rows.tolist(),
        "estimate": np.asarray(found[0], np.float64).tolist(),
        "spread": np.asarray(found[1], np.float64).tolist(),
    }
