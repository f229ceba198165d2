"""The networks that tell the ranges to ONNX: rows of a press to log odds, one output for each mode.

Source of the format: `range.onnx` of a bundle, docs/contracts.md; operators: the ONNX standard, opset 17.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from device.measurement.inversion import open_session
from device.measurement.mode import Mode
from host_tools.inverse.dense_network import Array
from host_tools.inverse.ensemble_network import add_members
from host_tools.inverse.export import AGREEMENT, ExportRefused, OnnxGraph
from host_tools.inverse.range_network import RangeNetwork
from host_tools.inverse.train_range import TrainedRange
from host_tools.inverse.wide_presses import DEPTHS, SIZES


def build_range_networks(networks: Mapping[Mode, RangeNetwork]) -> bytes:
    """Return the networks as serialised ONNX: features float32 [n, P] -> one float32 [n, 1] named as each mode."""
    graph, columns = OnnxGraph(), 0
    for mode, network in networks.items():
        columns = len(network.scaling.mean)
        graph.add("ReduceMean", add_members(graph, network.scaling, network.members), axes=[0], keepdims=0, output=mode)
    return graph.serialise(columns, dict.fromkeys(networks, 1))


def range_entry(trained: TrainedRange, network: bytes, rows: Array) -> dict[str, Any]:
    """Return what the card says of the networks; `rows` [n, P] are the golden features of the bundle.

    Raises `ExportRefused` when onnxruntime and NumPy differ.
    """
    return {
        "sha256": hashlib.sha256(network).hexdigest(),
        "size_mm": list(SIZES),
        "depth_mm": list(DEPTHS),
        "dataset_sha256": trained.dataset_sha256,
        "effort": vars(trained.effort),
        "surrogate_error": {
            "largest": float(trained.surrogate_error.max()),
            "mean": float(trained.surrogate_error.mean()),
        },
        "golden": {mode: _golden(mode, one, network, rows) for mode, one in trained.networks.items()},
    }


def _golden(mode: Mode, ours: RangeNetwork, network: bytes, rows: Array) -> list[float]:
    found = np.asarray(open_session(network).run([mode], {"features": rows.astype(np.float32)})[0], np.float64)[:, 0]
    expected = ours.log_odds(rows)
    worst = float(np.max(np.abs(found - expected) / np.maximum(np.abs(expected), 1.0)))
    if not worst <= 20 * AGREEMENT:
        raise ExportRefused(
            f"The exported network of the ranges in mode {mode} differs from NumPy by {worst:.2g}, but must agree "
            f"within {20 * AGREEMENT:.0g}: nothing was written, train anew."
        )
    return [float(one) for one in found]
